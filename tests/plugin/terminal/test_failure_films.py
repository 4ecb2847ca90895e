"""Films of what failed: which there are, where they are named, and why one is missing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.stored_ledger import checked_ledger
from pytest_garl.plugin.session.tally import Tally
from pytest_garl.plugin.terminal import failure_films
from pytest_garl.reports.run_reading import run_record_of
from tests.plugin.test_resume import slow_project, start, wait_for
from tests.reports.html.test_report import lost
from tests.support.broken_lander import case_of_broken_lander
from tests.support.landing_project import project
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.videos import Video, video

__all__ = ["video"]
RAISES = """
from pytest_garl import PositionSetpoint

class Lander:
    def reset(self, mission):
        self.home = mission.home_m

    def step(self, observation):
        if observation.time_s > 0.25:
            raise ZeroDivisionError("no plan")
        return PositionSetpoint(position_m=(*self.home[:2], 3.0))
"""
TESTS = """
import pytest
from stack_of_test import Lander
pytestmark = pytest.mark.garl(system=Lander, maps=["lawn"])

def test_lands(landing):
    assert landing.completed
"""
HIDES_ENCODERS = "import sys\nsys.modules['imageio_ffmpeg'] = None\n"
SEARCH = ("--garl-budget=2", "--garl-shrink=0", "--garl-workers=1")
SIGNATURE = "V:ZeroDivisionError@stack_of_test.step"
IN_PARALLEL = pytest.mark.parametrize("parallel", [(), ("-n2",)], ids=["alone", "n2"])
LONG_IN_PARALLEL = pytest.mark.parametrize(
    "parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)], ids=["alone", "n2"]
)


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", "--garl-film=failures", *args)


def drawn(pytester: pytest.Pytester) -> list[str]:
    """Return the names of the films; each is one."""
    found = sorted((pytester.path / ".garl" / "films").glob("**/*"))
    assert all(each.read_bytes()[4:8] == b"ftyp" for each in found)
    return [each.name for each in found]


@pytest.fixture
def raising(pytester: pytest.Pytester) -> pytest.Pytester:
    """Return a project of the built-in simulator whose landing system raises after 0.3 s."""
    pytester.makepyfile(stack_of_test=RAISES, test_it=TESTS)
    pytester.makeini("[pytest]\npythonpath = .\n")
    return pytester


@pytest.fixture
def case(raising: pytest.Pytester) -> str:
    """Return the name of a saved case, which is new and so fails."""
    path = Corpus(raising.path / "scenarios" / "regressions").save(case_of_broken_lander())
    assert path is not None
    return path.stem


@pytest.mark.sim
@IN_PARALLEL
def test_each_kind_of_a_search_has_a_film_that_is_named_beside_it(
    raising: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    earlier = raising.path / ".garl" / "films" / "lawn-g99-s99.mp4"
    earlier.parent.mkdir(parents=True)
    earlier.touch()
    result = run(raising, *SEARCH, *parallel)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            "garl: drawing 1 film of what failed, about * s",
            "*garl: violations*",
            f"     2  {SIGNATURE}*",
            "        film: .garl/films/lawn-g00-s00.mp4",
            "*garl: films*",
            "1 film of what failed in .garl/films",
        ]
    )
    assert drawn(raising) == ["lawn-g00-s00.mp4"]


@pytest.mark.sim
@LONG_IN_PARALLEL
def test_without_a_search_the_failed_cases_have_films(
    raising: pytest.Pytester, case: str, parallel: tuple[str, ...]
) -> None:
    result = run(raising, *parallel)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            "*garl: films*",
            f"film of case-{case}: .garl/films/case-{case}.mp4",
            "1 film of what failed in .garl/films",
        ]
    )
    assert drawn(raising) == [f"case-{case}.mp4"]
    # The ini key does the same, with a case that is known: it fails nothing.
    run_garl = "import sys; from pytest_garl.cli import main; main()"
    (file,) = raising.path.glob("scenarios/regressions/*/*.toml")
    accept = [sys.executable, "-c", run_garl, "cases", "accept", str(file)]
    subprocess.run(accept, cwd=raising.path, check=True, env=_environment())
    raising.makeini("[pytest]\npythonpath = .\ngarl_film = failures\n")
    again = raising.runpytest_subprocess("-p", "no:cacheprovider", *parallel)
    again.stdout.fnmatch_lines(["*garl: films*", "nothing failed, so no film was drawn"])
    assert drawn(raising) == []


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.mark.sim
@LONG_IN_PARALLEL
def test_what_failed_before_a_stop_has_a_film(
    raising: pytest.Pytester, case: str, parallel: tuple[str, ...]
) -> None:
    result = run(raising, *SEARCH, "-x", *parallel)
    result.stdout.fnmatch_lines(["*garl: films*", f"film of case-{case}: .garl/films/case-*.mp4"])
    assert f"case-{case}.mp4" in drawn(raising)


@LONG_IN_PARALLEL
def test_a_simulator_of_a_users_own_has_no_films(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-shrink=0", "--garl-workers=1", *parallel)
    result.stdout.fnmatch_lines(
        [
            "*garl: films*",
            "0 films of what failed in .garl/films",
            "no film of lawn-g00-s02, lawn-g00-s00: flown by tiny_simulator:fly, a simulator",
            "  of your own, whose camera cannot be drawn again",
        ]
    )
    result.stdout.no_fnmatch_line("garl: drawing*")
    assert drawn(pytester) == []


@pytest.mark.parametrize("ini", [False, True], ids=["option", "ini-key"])
@LONG_IN_PARALLEL
def test_without_an_encoder_nothing_is_flown(
    pytester: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    parallel: tuple[str, ...],
    ini: bool,
) -> None:
    project(pytester)
    conftest = pytester.path / "conftest.py"
    conftest.write_text(HIDES_ENCODERS + conftest.read_text())
    monkeypatch.setenv("PATH", "")
    args = [*parallel]
    if ini:
        (pytester.path / "pytest.ini").write_text("[pytest]\ngarl_film = failures\n")
    else:
        args += ["--garl-film=failures", "--garl-budget=8"]
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(
        ["*--garl-film=failures: a video needs an ffmpeg with the encoder libx264: there is no *"]
    )
    assert not (pytester.path / ".garl").exists()


@LONG_IN_PARALLEL
def test_an_interrupted_run_draws_nothing(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    slow_project(pytester)
    process = start(pytester, "--garl-film=failures", *parallel)
    wait_for(pytester.path / ".garl" / "ledger.sqlite", 8, process, patience_s=120)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=120)
    assert "interrupted, so no film was drawn; `garl film SLOT` draws what was flown" in output
    assert drawn(pytester) == []


@pytest.fixture
def session(
    tmp_path: Path, video: Video, monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config
) -> Iterator[Any]:
    """Return what stands in for reporter and run: twelve kinds, the second with two flights."""
    monkeypatch.chdir(tmp_path)
    kinds = [0, 1, 1, *range(2, 12)]
    flown = [Flown(result=lost(signature=f"II:lost:{n:02d}"), flight=video.flight) for n in kinds]
    lines: list[str] = []
    reporter = SimpleNamespace(
        config=pytestconfig,
        getreports=lambda outcome: [],
        ensure_newline=lambda: None,
        write_line=lines.append,
        _tw=SimpleNamespace(width_of_current_line=0),
        lines=lines,
    )
    options = SimpleNamespace(films=tmp_path / "films", workers=2)
    with checked_ledger(write_ledger(tmp_path, flown)) as ledger:
        tally = Tally()
        tally.record = run_record_of(ledger, Corpus(tmp_path))
        run = SimpleNamespace(options=options, ledger=ledger)
        yield SimpleNamespace(reporter=reporter, run=run, tally=tally)


def pretend(monkeypatch: pytest.MonkeyPatch, problem: str = "") -> list[str]:
    """Let films be drawn at once, on two cores; return the names of those that were asked for."""
    asked: list[str] = []

    def draw(tasks: Any, workers: int) -> list[str]:
        for task in tasks:
            asked.append(task.file.name)
            task.file.parent.mkdir(exist_ok=True)
            if not problem:
                task.file.touch()
        return [problem for _ in tasks]

    monkeypatch.setattr("pytest_garl.reports.films.draw_films", draw)
    monkeypatch.setattr("pytest_garl.reports.html.page_workers.cores", lambda: 2)
    return asked


def test_the_most_frequent_kinds_have_films_and_the_others_are_named(
    session: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = pretend(monkeypatch)
    found = failure_films.draw_failures(session.reporter, session.run, session.tally)
    assert asked == [f"lawn-g00-s{n:02d}.mp4" for n in (1, 0, 3, 4, 5, 6, 7, 8, 9, 10)]
    assert found.files["Hovers on lawn", "II:lost:01"].name == "lawn-g00-s01.mp4"
    assert len(found.files) == 10
    assert session.reporter.lines == ["garl: drawing 10 films of what failed, about 30 s"]
    assert found.notes[0].startswith("10 films of what failed in ")
    assert found.notes[1:] == (
        "10 films are drawn at most; `garl film SLOT` draws the others: lawn-g00-s11, lawn-g00-s12",
    )


def test_a_slot_of_two_systems_has_two_films() -> None:
    def failure(system: str, search: str, index: int) -> failure_films._Failure:
        flight: Any = SimpleNamespace(
            id=FlightId(search=search * 16, map="lawn", slot=Slot(generation=0, index=index))
        )
        return failure_films._Failure(key=(system, "I"), name=flight.id.slot_id, flight=flight)

    both = [failure("a:A", "a", 1), failure("b:B", "b", 1), failure("b:B", "b", 2)]
    assert failure_films._names(both) == [
        "aaaaaaaa-lawn-g00-s01",
        "bbbbbbbb-lawn-g00-s01",
        "lawn-g00-s02",
    ]


def test_a_reason_is_told_once(session: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    pretend(monkeypatch, "no space left")
    found = failure_films.draw_failures(session.reporter, session.run, session.tally)
    assert found.files == {}
    names = "lawn-g00-s01, lawn-g00-s00, lawn-g00-s03, lawn-g00-s04, lawn-g00-s05 and 5 more"
    assert f"no film of {names}: no space left" in found.notes


def test_ctrl_c_keeps_the_films_that_are_drawn(
    session: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(tasks: Any, workers: int) -> list[str]:
        tasks[0].file.parent.mkdir()
        tasks[0].file.touch()
        raise KeyboardInterrupt

    monkeypatch.setattr("pytest_garl.reports.films.draw_films", interrupted)
    found = failure_films.draw_failures(session.reporter, session.run, session.tally)
    assert [each.name for each in found.files.values()] == ["lawn-g00-s01.mp4"]
    assert found.notes[1] == "interrupted while films were drawn; `garl film SLOT` draws the others"


def test_a_folder_that_cannot_be_made_is_one_note(session: Any) -> None:
    session.run.options.films.write_text("a file")
    found = failure_films.draw_failures(session.reporter, session.run, session.tally)
    assert any("films: no films can be written here" in note for note in found.notes)
