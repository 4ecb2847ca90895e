"""Many films at a time: in processes, each whole or not at all."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.execution.stored_ledger import checked_ledger
from pytest_garl.reports.films import FilmTask, draw_films, recorded_flight
from tests.reports.html.test_report import lost
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.videos import Video, video

__all__ = ["video"]


@pytest.fixture
def tasks(tmp_path: Path, video: Video) -> list[FilmTask]:
    flown = [Flown(result=lost(signature=f"II:{n}"), flight=video.flight) for n in range(3)]
    with checked_ledger(write_ledger(tmp_path, flown)) as ledger:
        return [
            FilmTask(
                flight=recorded_flight(ledger, each),
                file=tmp_path / "films" / f"{each.id.slot_id}.mp4",
            )
            for each in ledger.queries.flights()
        ]


def test_films_are_drawn_in_processes_and_a_missing_record_is_told(tasks: list[FilmTask]) -> None:
    nowhere = dataclasses.replace(tasks[1].flight, records=(Path("nowhere/a.npz"),))
    tasks[1] = dataclasses.replace(tasks[1], flight=nowhere)
    first, missing, last = draw_films(tasks, 2)
    assert (first, last) == ("", "")
    assert missing.startswith("The record of this flight is missing: expected a.npz in nowhere")
    folder = tasks[0].file.parent
    assert sorted(each.name for each in folder.iterdir()) == [
        "lawn-g00-s00.mp4",
        "lawn-g00-s02.mp4",
    ]


def test_an_interrupt_leaves_whole_films_only(tasks: list[FilmTask]) -> None:
    def interrupt(done: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        draw_films(tasks, 1, interrupt)
    assert [each.name for each in tasks[0].file.parent.iterdir()] == ["lawn-g00-s00.mp4"]
    assert tasks[0].file.read_bytes()[4:8] == b"ftyp"


def test_nothing_to_draw_makes_no_folder() -> None:
    assert draw_films([], 2) == []
