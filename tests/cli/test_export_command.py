"""``garl export``: a slot, a case and a record become files; what cannot be is said at once."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import Corpus, replace_file
from pytest_garl.cases.replay import replay
from pytest_garl.cli import main
from pytest_garl.execution.reference import Reference
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import hash_of, save
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.files import dumps
from tests.support.broken_lander import SYSTEM, case_of_broken_lander
from tests.support.mcap_files import needs_extra, read_mcap
from tests.support.recorded_flights import recorded
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.results import flight_result
from tests.support.videos import LAWN, SCENARIO, Hovers, Video, video

needs_extra()
__all__ = ["video"]
SLOT = "lawn-g00-s00"


def garl(*args: str | Path) -> Result:
    return CliRunner().invoke(main, ["export", *map(str, args)], env={"COLUMNS": "200"})


def refused(*args: str | Path) -> str:
    done = garl(*args)
    assert done.exit_code == 1
    assert "Traceback" not in done.output
    assert not list(Path.cwd().glob("*.mcap"))
    return done.output


@pytest.fixture
def ledger(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, video: Video) -> Path:
    """Return the ledger of a run in the present folder, with one flight that has a record."""
    monkeypatch.chdir(tmp_path)
    result = flight_result()
    return write_ledger(tmp_path, [Flown(result=result, flight=video.flight), Flown(result=result)])


@pytest.mark.usefixtures("ledger")
def test_a_slot_is_exported_from_its_record(video: Video) -> None:
    done = garl(SLOT, "--mcap=flight.mcap")
    assert done.exit_code == 0, done.output
    assert done.output.startswith("flight.mcap: 3.0 s of flight, ")
    assert ", 30 pictures, " in done.output
    found = read_mcap(Path("flight.mcap"))
    assert len(found.topics["/camera/image"]) == len(video.flight.steps) == 30
    (first, *_) = found.topics["/events"]
    assert first[1].message.startswith("flight 01234567-lawn-g00-s00, flown with pytest-garl ")
    assert garl("01234567-lawn-g00-s00", "--mcap=again.mcap").exit_code == 0
    assert Path("again.mcap").read_bytes() == Path("flight.mcap").read_bytes()


def test_a_record_takes_its_scenario_from_the_ledger_beside_it(ledger: Path) -> None:
    (record,) = (ledger.parent / "flights").iterdir()
    assert garl(SLOT, "--mcap=slot.mcap").exit_code == 0
    assert garl(record, "--mcap=record.mcap").exit_code == 0
    assert Path("record.mcap").read_bytes() == Path("slot.mcap").read_bytes()


@pytest.mark.usefixtures("ledger")
def test_a_record_that_no_ledger_knows_has_no_pictures(tmp_path: Path, video: Video) -> None:
    record = tmp_path / "elsewhere" / "mine.npz"
    moved = dataclasses.replace(video.flight, outcome="gave_up")
    save(dataclasses.replace(moved, sha256=hash_of(moved)), record)
    done = garl(record, "--mcap=flight.mcap")
    assert done.exit_code == 0
    assert "garl: no pictures, no bodies: " in done.output
    assert "holds neither its scenario nor its camera" in done.output
    assert "The limits of its test are not known" in done.output
    assert "/camera/image" not in read_mcap(Path("flight.mcap")).topics
    (tmp_path / "it.toml").write_text(dumps(SCENARIO, LAWN))
    told = ("--scenario=it.toml", "--system=tests.support.videos:Hovers")
    assert ", 30 pictures, " in garl(record, *told, "--mcap=flight.mcap").output


def written(folder: Path, flight: Flight, **facts: Any) -> str:
    """Return what is said of the export of a ledger's only flight."""
    write_ledger(folder, [Flown(result=flight_result(), flight=flight)], **facts)
    done = garl(SLOT, "--mcap=flight.mcap")
    assert done.exit_code == 0, done.output
    assert "/camera/image" not in read_mcap(Path("flight.mcap")).topics
    return done.output


def test_what_is_missing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, video: Video
) -> None:
    monkeypatch.chdir(tmp_path)
    own = Reference(module="my_simulator", file="", qualname="fly")
    bare = dataclasses.replace(recorded(steps=()), sha256="ab" * 32)
    words = written(tmp_path, bare, simulator=own)
    assert "no pictures, no bodies: flown by my_simulator:fly, a simulator of your own" in words
    words = written(tmp_path, video.flight, camera=None)
    assert "no pictures: the ledger does not name the camera" in words
    assert "/map" in read_mcap(Path("flight.mcap")).topics
    dark = tuple(dataclasses.replace(step, marker_px=0.0) for step in video.flight.steps)
    words = written(tmp_path, dataclasses.replace(video.flight, steps=dark))
    assert "no pictures: the landing system used no camera" in words


def test_a_ledger_with_a_camera_that_is_none_gives_no_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, video: Video
) -> None:
    monkeypatch.chdir(tmp_path)
    broken = dataclasses.replace(Hovers.airframe.camera)
    object.__setattr__(broken, "rate_hz", -1.0)
    assert isinstance(broken, Camera)
    words = written(tmp_path, video.flight, camera=broken)
    assert "no pictures: the camera in the ledger is damaged" in words


def test_a_case_is_flown_again_and_its_record_gives_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "stack_of_test.py").write_text(SYSTEM)
    path = Corpus(tmp_path / "scenarios" / "regressions").save(case_of_broken_lander())
    assert path is not None
    try:
        for name in (path, path.stem, f"case-{path.stem}"):
            done = garl(name, "--mcap=flight.mcap")
            assert done.exit_code == 0, done.output
        found = read_mcap(Path("flight.mcap"))
        assert found.topics["/events"][0][1].message.startswith(f"flight {path.stem}, ")
        assert len(found.topics["/camera/image"]) > 1
        (tmp_path / "broken").touch()
        assert garl(path, "--mcap=flown.mcap").output.endswith(", flown again\n")
        case = load_case(path)
        flight = replay(case, tmp_path).flight
        assert flight is not None
        evidence = dataclasses.replace(case.evidence, trajectory_sha256=flight.sha256)
        replace_file(path, dataclasses.replace(case, evidence=evidence))
        flown = [Flown(result=flight_result(), flight=flight, scenario=case.scenario)]
        write_ledger(tmp_path, flown, system=case.system, camera=Camera())
        assert garl(path, "--mcap=recorded.mcap").output.endswith(", from its record\n")
        assert Path("recorded.mcap").read_bytes() == Path("flown.mcap").read_bytes()
    finally:
        sys.modules.pop("stack_of_test", None)


def test_a_target_that_cannot_be_written_is_refused_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.mcap").mkdir()
    (tmp_path / "file").touch()
    targets = {
        "flight.toml": "expected a name that ends in .mcap",
        "file/flight.mcap": "cannot be written (Not a directory)",
        "/proc/flight.mcap": "/proc/flight.mcap: cannot be written",
    }
    for target, words in targets.items():
        # The name of the flight is wrong too; nobody looks at it.
        assert words in garl("no flight", f"--mcap={target}").output
    done = garl("no flight", "--mcap=folder.mcap")
    assert "folder.mcap: found a folder, expected the name of a file" in done.output
    assert sorted(each.name for each in tmp_path.iterdir()) == ["file", "folder.mcap"]


def test_without_the_extra_it_is_refused_before_the_flight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "foxglove", None)
    words = refused("no flight", "--mcap=flight.mcap")
    assert "pip install 'pytest-garl[mcap]'" in words
    assert "found no flight" not in words
