"""Which flight a name means, where the end-to-end tests of the commands do not tell."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.cli import named_flight as module
from pytest_garl.cli.named_flight import named_flight
from pytest_garl.errors import CorpusError, GarlError
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.regressions.replay import Replay
from pytest_garl.simulation.flight import Flight
from tests.regressions.samples import LAWN
from tests.regressions.samples import case as dog_case
from tests.support.recorded_flights import recorded, seen
from tests.support.videos import Hovers


@pytest.fixture
def corpus(tmp_path: Path) -> Corpus:
    found = Corpus(tmp_path / "scenarios" / "regressions")
    assert found.save(dog_case()) is not None
    return found


def replays(monkeypatch: pytest.MonkeyPatch, flight: Flight | None) -> None:
    """Let a case be flown by nobody, with this record."""

    def replay(case: Case, *args: object) -> Replay:
        return Replay(
            result="FAILED",
            outcome="collision",
            signature=case.violation.signature,
            description="",
            judged_by="nobody",
            reasons=(),
            flight=flight,
            map=LAWN,
            same_flight=None,
        )

    monkeypatch.setattr(module, "replay", replay)
    monkeypatch.setattr(module, "system_of", lambda case, root: Hovers)


def test_a_case_has_the_camera_of_its_system(
    corpus: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = dataclasses.replace(
        recorded(steps=seen(range(10))), versions=(("pytest-garl", "0.2.0"),)
    )
    replays(monkeypatch, flight)
    found = named_flight(dog_case().id, corpus, tmp_path)
    assert (found.name, found.signature) == (dog_case().id, "IV:dog:last-metre:unseen")
    assert (found.scenario, found.map) == (dog_case().scenario, LAWN)
    assert (found.camera, found.notes) == (Hovers.airframe.camera, ())


def test_a_case_of_a_simulator_of_the_users_own_has_no_place(
    corpus: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replays(monkeypatch, recorded(steps=seen(range(10))))
    found = named_flight(dog_case().id, corpus, tmp_path)
    assert (found.scenario, found.map, found.camera) == (None, None, None)
    assert "simulator of your own: no pictures" in found.notes[0]


def test_a_case_whose_process_ended_early_has_no_flight(
    corpus: Corpus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replays(monkeypatch, None)
    with pytest.raises(GarlError, match="ended before the flight was recorded"):
        named_flight(dog_case().id, corpus, tmp_path)


def test_a_broken_case_says_what_is_wrong_with_it(corpus: Corpus, tmp_path: Path) -> None:
    (path,) = (entry.path for entry in corpus.all_entries())
    path.write_text("schema = ")
    with pytest.raises(CorpusError, match="not valid TOML"):
        named_flight(path.stem, Corpus(corpus.folder), tmp_path)
