"""Any flight as a film: a slot of a run, a saved case, a flight's own file."""

from __future__ import annotations

import dataclasses
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import pytest
from click.testing import CliRunner, Result

from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import replace_file
from pytest_garl.cli import main
from pytest_garl.execution.reference import Reference
from pytest_garl.flight.flight_file import save
from pytest_garl.scenarios.files import dumps
from tests.reports.html.test_report import lost
from tests.support.broken_lander import broken_project
from tests.support.ffmpeg import hide_encoders
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.results import flight_result
from tests.support.videos import CLOSING_FRAMES, LAWN, SCENARIO, Video, video

__all__ = ["video"]
SLOT = "lawn-g00-s01"
HOVERS = """
from pytest_garl.landing_system import Airframe, Camera

class Hovers:
    airframe = Airframe(camera=Camera(width_px=640, height_px=480))
    def reset(self, mission): ...
    def step(self, observation): ...
"""


def garl(*args: str | Path) -> Result:
    return CliRunner().invoke(main, ["film", *map(str, args)], env={"COLUMNS": "200"})


def drawn(*args: str | Path) -> str:
    done = garl(*args)
    assert done.exit_code == 0, done.output
    return done.output


def refused(*args: str | Path) -> str:
    done = garl(*args)
    assert done.exit_code == 1, done.output
    assert done.output.startswith("Error: ")
    return done.output


def pictures_in(path: Path) -> int:
    film = cv2.VideoCapture(str(path))
    count = 0
    while film.read()[0]:
        count += 1
    film.release()
    return count


@pytest.fixture
def run(tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder, which is the present one, of a run with one violation."""
    landed = Flown(result=flight_result(completed=True), flight=video.flight)
    write_ledger(tmp_path, [landed, Flown(result=lost(), flight=video.flight)])
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the case file of a project whose lander is broken, relative to the project."""
    yield from broken_project(tmp_path, monkeypatch)


def test_a_slot_is_drawn_from_its_record(run: Path) -> None:
    assert drawn(SLOT).startswith(f"{SLOT}.mp4: 3.0 s, 0.")
    assert pictures_in(run / f"{SLOT}.mp4") == 30 + CLOSING_FRAMES
    assert {each.name for each in run.iterdir()} == {".garl", f"{SLOT}.mp4"}


def test_a_film_may_show_the_last_seconds_as_a_gif(run: Path) -> None:
    words = drawn(SLOT, "-o", "end.gif", "--last=1")
    assert words.startswith("end.gif: the last 1.0 s, ")
    assert words.endswith(", from its record\n")
    assert (run / "end.gif").read_bytes()[:6] == b"GIF89a"


def test_another_ledger_has_its_records_beside_it(run: Path, tmp_path: Path) -> None:
    shutil.move(run / ".garl", tmp_path / "ci")
    assert "there is no ledger at .garl/ledger.sqlite; run a search first" in refused(SLOT)
    drawn(SLOT, "--ledger=ci/ledger.sqlite", "--last=1")


def test_a_simulator_of_a_users_own_has_no_film(
    tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Reference(module="my_simulator", file="", qualname="fly")
    write_ledger(tmp_path, [Flown(result=lost(), flight=video.flight)], simulator=other)
    monkeypatch.chdir(tmp_path)
    assert "flown by my_simulator:fly, a simulator of your own" in refused("lawn-g00-s00")


def test_a_ledger_without_a_camera_says_so(
    tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_ledger(tmp_path, [Flown(result=lost(), flight=video.flight)], camera=None)
    monkeypatch.chdir(tmp_path)
    assert "the ledger does not name the camera" in refused("lawn-g00-s00")


def test_a_flights_file_is_drawn_as_its_ledger_says(run: Path, video: Video) -> None:
    save(video.flight, run / "mine.npz")
    drawn("mine.npz")
    assert pictures_in(run / "mine.mp4") == 30 + CLOSING_FRAMES


def test_a_record_finds_the_ledger_of_its_run(
    run: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    record = run / ".garl" / "flights" / f"01234567-{SLOT}.npz"
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    drawn(record, "-o", "it.mp4", "--last=1")
    shutil.move(run / ".garl" / "ledger.sqlite", run / ".garl" / "repeat.sqlite")
    drawn(record, "-o", "it.mp4", "--last=1")
    assert "there is no ledger at nowhere.sqlite" in refused(record, "--ledger=nowhere.sqlite")


def test_a_flights_file_of_no_ledger_needs_scenario_and_system(
    tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    save(video.flight, tmp_path / "mine.npz")
    (tmp_path / "stack_that_hovers.py").write_text(HOVERS)
    (tmp_path / "it.toml").write_text(dumps(SCENARIO, LAWN))
    error = refused("mine.npz")
    assert "holds neither its scenario nor its camera: name the ledger of its run" in error
    assert "found no --system, expected --scenario" in refused("mine.npz", "--scenario=it.toml")
    told = ("--scenario=it.toml", "--system=stack_that_hovers:Hovers")
    assert "have no effect here" in refused(SLOT, *told)
    assert "\nmine.mp4: 3.0 s" in drawn("mine.npz", *told)
    fewer = SCENARIO.without("dog-1")
    (tmp_path / "fewer.toml").write_text(dumps(fewer, LAWN))
    assert "this flight is not of this scenario" in refused(
        "mine.npz", "--scenario=fewer.toml", told[1]
    )
    assert "cannot be imported as a landing system" in refused(
        "mine.npz", "--scenario=it.toml", "--system=nowhere:Hovers"
    )


def test_a_saved_case_is_flown_again_by_its_name_or_its_file(case: Path) -> None:
    words = drawn(case)
    assert words.startswith(f"flying {case.stem} again: no record of its flight at .garl/")
    assert f"\n{case.stem}.mp4: 0.0 s, " in words
    assert words.endswith(", flown again\n")
    assert Path(f"{case.stem}.mp4").read_bytes()[4:8] == b"ftyp"
    assert f"\n{case.stem}.mp4: " in drawn(f"{case.parent.name}/{case.stem}")
    assert f"\ncase-{case.stem}.mp4: " in drawn(f"case-{case.stem}")
    # Its policy stands still, so a live one flies the same.
    assert f"\ncase-{case.stem}-live.mp4: " in drawn(f"case-{case.stem}-live")


def test_a_saved_case_is_drawn_from_the_record_that_the_ledger_has(
    case: Path, video: Video
) -> None:
    write_ledger(Path.cwd(), [Flown(result=lost(), flight=video.flight)])
    saved = load_case(case)
    evidence = dataclasses.replace(saved.evidence, trajectory_sha256=video.flight.sha256)
    file = replace_file(case, dataclasses.replace(saved, evidence=evidence))
    assert "flown again" in drawn(file, "-o", "it.mp4"), "of another system"
    shutil.rmtree(".garl")
    flown = [Flown(result=lost(signature=saved.violation.signature), flight=video.flight)]
    write_ledger(Path.cwd(), flown, system=saved.system)
    assert drawn(file, "-o", "it.mp4").startswith("it.mp4: 3.0 s")
    shutil.rmtree(".garl/flights")
    assert "flown again" in drawn(file, "-o", "it.mp4")


def test_a_ledger_that_cannot_be_read_keeps_no_case_from_being_flown(case: Path) -> None:
    evidence = dataclasses.replace(load_case(case).evidence, trajectory_sha256="f" * 64)
    file = replace_file(case, dataclasses.replace(load_case(case), evidence=evidence))
    Path(".garl").mkdir()
    Path(".garl/ledger.sqlite").write_text("no ledger")
    words = drawn(file, "-o", "it.mp4")
    assert words.startswith(".garl/ledger.sqlite: file is not a database")
    assert "flown again" in words
    assert "file is not a database" in refused(file, "--ledger=.garl/ledger.sqlite")
    assert "there is no ledger at nowhere.sqlite" in refused(file, "--ledger=nowhere.sqlite")


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("-o", "a.avi"), "a.avi: found the suffix '.avi', expected .mp4 or .gif"),
        (("-o", "nowhere/a.mp4"), "expected a folder for the film"),
    ],
)
def test_a_film_that_cannot_be_written_is_refused_before_the_case_flies(
    case: Path, args: tuple[str, ...], words: str
) -> None:
    error = refused(case, *args)
    assert words in error
    assert "flying" not in error


def test_without_an_encoder_nothing_is_flown(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hide_encoders(monkeypatch)
    error = refused(case)
    assert "pip install 'pytest-garl[video]'" in error
    assert "flying" not in error


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.long)]
)
def test_a_film_that_is_interrupted_leaves_nothing(run: Path, number: int) -> None:
    start = "from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", start, "film", SLOT]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        command, cwd=run, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        until = time.monotonic() + 60.0
        while not list(run.glob(f".{SLOT}.mp4.*")) and time.monotonic() < until:
            assert process.poll() is None, process.communicate()[0]
            time.sleep(0.005)
        process.send_signal(number)
        output = process.communicate(timeout=60.0)[0].decode()
    assert process.returncode == (143 if number == signal.SIGTERM else 1), output
    assert {each.name for each in run.iterdir()} == {".garl"}
