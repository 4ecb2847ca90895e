"""Searches that are interrupted, or resumed after they were done: what they save."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.plugin.test_resume import BUDGET, SLOW, alive, query, slow_project, start, wait_for
from tests.support.landing_project import CONFTEST, project, run

SEARCH = ("--garl-budget=24", "--garl-shrink=12", "--garl-workers=2", "--garl-map=lawn")
TWICE = """
def pytest_keyboard_interrupt(excinfo):
    raise KeyboardInterrupt
"""
"""A second Ctrl-C while pytest tells of the first one."""
WITHOUT_LINE = """
import sys, types

def code_without_lines():
    return sys._getframe()

code = code_without_lines.__code__
units = len(code.co_code) // 2
# An entry of the table of locations that says of up to eight code units that they have none.
table = bytes(0xF8 | min(8, units - start) - 1 for start in range(0, units, 8))
code_without_lines.__code__ = code.replace(co_linetable=table)

def interrupt():
    last = types.TracebackType(None, code_without_lines(), 0, -1)
    assert last.tb_lineno is None
    return KeyboardInterrupt().with_traceback(last)

def pytest_runtest_setup(item):
    if item.name.endswith("g00-s01]"):
        try:
            raise interrupt()
        finally:
            raise interrupt()
"""
"""Two interrupts on instructions without a line: Python 3.11 gives none to some jumps of loops."""


def cases(folder: Path) -> dict[str, bytes]:
    """Return the saved cases and what is in them."""
    return {path.name: path.read_bytes() for path in folder.glob("scenarios/regressions/*/*.toml")}


def flown(pytester: pytest.Pytester) -> list[tuple[int, ...]]:
    return query(
        pytester.path / ".garl" / "ledger.sqlite",
        "SELECT CAST(value AS INT) FROM meter WHERE name IN ('flights', 'on_demand') ORDER BY name",
    )


def test_resumed_finished_run_saves_what_is_missing_and_repeats_its_outcome(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, "Good", "['lawn']")
    run(pytester, *SEARCH)
    saved, before = cases(pytester.path), flown(pytester)
    assert len(saved) > 1
    # As a kill may have prevented.
    for name in list(saved)[1:]:
        next(pytester.path.glob(f"scenarios/**/{name}")).unlink()
    for _ in range(2):
        again = run(pytester, *SEARCH, "--garl-resume")
        assert again.ret == pytest.ExitCode.TESTS_FAILED
        assert (cases(pytester.path), flown(pytester)) == (saved, before)
    again.stdout.fnmatch_lines(["*the same case is saved already*"])
    less = run(pytester, *SEARCH, "--garl-shrink=10", "--garl-resume")
    assert less.ret == pytest.ExitCode.TESTS_FAILED
    less.stdout.no_fnmatch_line("*bred in another way*")


@pytest.mark.long
def test_finished_run_resumes_with_more_shrinking(pytester: pytest.Pytester) -> None:
    project(pytester, "Good", "['lawn']")
    run(pytester, *SEARCH)
    again = run(pytester, *SEARCH, "--garl-shrink=30", "--garl-resume")
    assert again.ret == pytest.ExitCode.TESTS_FAILED
    again.stdout.no_fnmatch_line("*bred in another way*")


@pytest.mark.parametrize("conftest", ["", pytest.param(TWICE, marks=pytest.mark.long)])
def test_ctrl_c_saves_nothing_of_half_a_search(pytester: pytest.Pytester, conftest: str) -> None:
    slow_project(pytester)
    (pytester.path / "test_it.py").write_text(
        (pytester.path / "test_it.py").read_text() + "\n\ndef test_fails(landing): assert False\n"
    )
    pytester.makeconftest(CONFTEST + conftest)
    process = start(pytester, "--garl-shrink=12")
    wait_for(pytester.path / ".garl" / "ledger.sqlite", 8, process, patience_s=120)
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=120)
    assert "confirming" not in output
    assert cases(pytester.path) == {}
    resumed = run(pytester, *BUDGET, "--garl-shrink=12", "--garl-resume")
    resumed.stdout.fnmatch_lines(["*confirming and shrinking*"])
    assert cases(pytester.path)


PARALLEL = pytest.mark.parametrize(
    "parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)], ids=["alone", "xdist"]
)


@PARALLEL
def test_sigterm_ends_a_search_with_its_summary_and_the_way_to_continue(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    slow_project(pytester)
    # Not so fast that xdist's workers fly all while they end.
    pytester.makepyfile(systems=SLOW.replace("0.03", "0.5" if parallel else "0.03"))
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    process = start(pytester, *parallel)
    wait_for(ledger, 2, process)
    workers = [pid for (pid,) in query(ledger, "SELECT pid FROM worker")]
    # `timeout` sends the signal twice.
    process.send_signal(signal.SIGTERM)
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=60)
    assert process.returncode == pytest.ExitCode.INTERRUPTED, output
    assert "garl: violations" in output
    assert "of 30 flown; the same command with --garl-resume goes on" in output
    assert "Terminated: SIGTERM" in output
    assert workers
    assert not any(alive(pid) for pid in workers)


@pytest.mark.parametrize("method", ["finish", "further"])
def test_sigterm_while_kinds_are_shrunk_saves_what_has_ended_and_names_the_way_to_continue(
    pytester: pytest.Pytester, method: str
) -> None:
    slow_project(pytester)
    conftest = (
        "import os, signal\n"
        "from pytest_garl.triage.investigation_queue import Investigations\n"
        "def end(*args):\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        f"Investigations.{method} = end\n"
    )
    pytester.makeconftest(CONFTEST + conftest)
    ended = run(pytester, *SEARCH)
    assert ended.ret == pytest.ExitCode.INTERRUPTED
    ended.stdout.fnmatch_lines(
        ["garl: interrupted before everything was saved; *--garl-resume goes on", "*in *s*"]
    )
    # Other causes are looked for when the first of each kind has ended; before, some may have.
    saved = cases(pytester.path)
    assert len(saved) == 2 or method == "finish"
    ended.stdout.fnmatch_lines([f"saved *{name}" for name in saved])
    pytester.makeconftest(CONFTEST)
    run(pytester, *SEARCH, "--garl-resume")
    assert cases(pytester.path).items() >= saved.items()


def test_sigterm_handler_of_the_user_stays(pytester: pytest.Pytester) -> None:
    project(pytester, "Good", "['lawn']")
    conftest = (
        "import signal\n"
        "signal.signal(signal.SIGTERM, lambda number, frame: None)\n"
        "mine = signal.getsignal(signal.SIGTERM)\n"
        "def pytest_sessionfinish():\n"
        "    assert signal.getsignal(signal.SIGTERM) is mine\n"
    )
    pytester.makeconftest(CONFTEST + conftest)
    assert run(pytester, "--garl-budget=2").ret in (0, 1)


def test_ctrl_c_on_an_instruction_without_line_still_ends_with_the_summary(
    pytester: pytest.Pytester,
) -> None:
    project(pytester, "Good", "['lawn']")
    pytester.makeconftest(CONFTEST + WITHOUT_LINE)
    result = run(pytester, "--garl-budget=8", "--full-trace")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines(["*garl: violations*", "*! KeyboardInterrupt !*", "*1 failed in*"])


@pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
def test_run_leaves_nothing_but_its_ledger_and_flights(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester, "Good", "['lawn']")
    folder = pytester.path / ".garl"
    folder.mkdir()
    (folder / "cases-4194303.sqlite-wal").touch()
    run(pytester, *SEARCH, *parallel)
    run(pytester, *parallel)
    assert {path.name for path in folder.iterdir()} == {"flights", "ledger.lock", "ledger.sqlite"}
