from __future__ import annotations

import dataclasses
import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.plugin import run_progress
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.run_progress import ProgressReader, RunProgress, progress_line
from pytest_garl.regressions.forecast import RemainingWork
from tests.support.landing_project import project, run

SLOW = """
import time
from systems import Good

class Slow(Good):
    def step(self, observation):
        time.sleep(0.4)
        return super().step(observation)
"""
LINE = re.compile(r"garl \[[#-]+\]  \d+/\d+ flights")
PARALLEL = pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
WIDTH = 60


def on_a_terminal(pytester: pytest.Pytester, *args: str, term: str = "xterm") -> str:
    """Run pytest on a terminal of 60 columns; return what it wrote."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, WIDTH, 0, 0))
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--tb=no", *args]
    environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
    child = subprocess.Popen(
        command,
        cwd=pytester.path,
        env={**environment, "TERM": term},
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=subprocess.STDOUT,
    )
    os.close(theirs)
    written = b""
    try:
        while data := os.read(ours, 4096):
            written += data
    except OSError:
        pass  # how Linux tells that the other end is closed
    finally:
        os.close(ours)
        child.wait()
    return written.decode()


def screen(written: str) -> list[str]:
    """Return the rows that a terminal shows, which is long enough never to scroll."""
    rows: dict[int, str] = {}
    row = column = 0
    saved = (0, 0)
    for token in re.findall(r"\x1b\[[0-9;]*[A-Za-z]|\x1b.|.", written, re.DOTALL):
        if token == "\r":
            column = 0
        elif token in ("\n", "\x1bD"):
            row += 1
        elif token == "\x1bM":
            row -= 1
        elif token == "\x1b7":
            saved = row, column
        elif token == "\x1b8":
            row, column = saved
        elif token == "\x1b[J":
            rows = {at: line for at, line in rows.items() if at <= row}
            rows[row] = rows.get(row, "")[:column]
        elif not token.startswith("\x1b"):
            line = rows.get(row, "").ljust(column)
            rows[row] = line[:column] + token + line[column + 1 :]
            column += 1
        else:
            assert token.endswith("m"), f"not modelled: {token!r}"
    return [rows.get(at, "") for at in range(max(rows) + 1)]


def slow_project(pytester: pytest.Pytester) -> None:
    project(pytester, "Slow")
    pytester.makepyfile(slow=SLOW)
    test = pytester.path / "test_it.py"
    test.write_text(test.read_text().replace("from systems import *", "from slow import Slow"))


@pytest.mark.parametrize("args", [("-q",), ("-v",), ("-q", "-n2"), ("-v", "-n2")])
def test_the_progress_line_comes_and_goes(pytester: pytest.Pytester, args: tuple[str, ...]) -> None:
    slow_project(pytester)
    written = on_a_terminal(
        pytester, "--garl-budget=5", "--garl-shrink=0", "--garl-workers=1", "--no-summary", *args
    )
    during = screen(written[: [match.end() for match in LINE.finditer(written)][-1]])
    assert LINE.match(during[-1]), "the line is the last on the screen"
    drawn = re.findall(r"\r\n(garl \[[^\x1b\r\n]*)\x1b", written)
    assert len(set(drawn)) > 2
    assert all(len(line) < WIDTH for line in drawn)
    after = "\n".join(screen(written))
    assert not LINE.search(after)
    assert "flights/s" not in after
    assert re.search(r"^=* ?.*\d+ passed.* in [\d.]+s", after, re.MULTILINE)


@pytest.mark.parametrize(
    ("args", "term"),
    [(("--garl-workers=1",), "dumb"), (("--garl-workers=0",), "xterm")],
    ids=["dumb", "in-process"],
)
def test_no_line_where_it_would_disturb(
    pytester: pytest.Pytester, args: tuple[str, ...], term: str
) -> None:
    slow_project(pytester)
    written = on_a_terminal(pytester, "--garl-budget=2", "--garl-shrink=0", "-q", *args, term=term)
    assert "garl: violations" in written
    assert not re.search(r"garl \[", written)
    assert "\x1b7" not in written


def test_a_dead_worker_leaves_no_litter(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    pytester.makeconftest(
        "import os\nfrom tiny_simulator import fly\n"
        "def pytest_garl_fly(config): return fly\n"
        "def pytest_runtest_teardown(item): 's02' in item.name and os._exit(4)\n"
    )
    only = ("-k", "test_time", "--max-worker-restart=1")
    written = on_a_terminal(
        pytester, "--garl-budget=5", "--garl-shrink=0", "--garl-workers=1", "-n2", *only
    )
    assert LINE.search(written)
    rows = [row.rstrip() for row in screen(written)]
    assert any(re.fullmatch(r"replacing crashed worker gw\d", row) for row in rows)
    assert not any(LINE.search(row) for row in rows)


TWO = (
    SearchProgress(system="m:A", map="court", flown=3, all=4, generation=1),
    SearchProgress(system="m:A", map="lawn", flown=1, all=4, generation=0),
)
PROGRESS = RunProgress(
    searches=TWO,
    kinds={"I": 2, "IV": 1},
    nearest={"time": (90.3, "s"), "collision": (0.25, "m"), "crash": (1.0, "1")},
    seconds=8.0,
    expected_after=8.0,
)


def test_the_line_has_one_total_and_names_what_matters_first() -> None:
    assert progress_line(PROGRESS, 160) == (
        "garl [#####---------------]  4/16 flights  24 s left  I:2 IV:1  A on court g01 3/4  "
        "0.50 flights/s  nearest collision 0.25 m, time 90 s"
    )
    more = dataclasses.replace(PROGRESS, selected=40)
    assert "4/48 flights" in progress_line(more, 160)
    new = RunProgress(searches=TWO[1:], kinds={}, nearest={}, seconds=0.0)
    assert progress_line(new, 160) == "garl [#####---------------]  1/4 flights  A on lawn g00 1/4"


def test_the_first_line_now_and_then_counts_the_time_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [100.0]
    monkeypatch.setattr(run_progress, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    reader = ProgressReader(
        cast(Run, SimpleNamespace(remaining=RemainingWork(at_most=0, flights=0.0, seconds=0.0))),
        30.0,
    )
    reader.start_clock()
    clock[0] += 30.0
    queries = SimpleNamespace(
        progress=lambda: [TWO[1]], meters=dict, violation_counts=dict, nearest=dict
    )
    ledger = SimpleNamespace(queries=queries, fact=lambda key: None)
    found = reader.read(cast(Ledger, ledger))
    assert found is not None
    assert found.seconds == 30.0


@pytest.mark.parametrize("width", range(20, 160, 7))
def test_a_narrow_terminal_gets_whole_words(width: int) -> None:
    line = progress_line(PROGRESS, width)
    assert len(line) <= max(width, len("garl [##--------]"))
    assert {*line.split("  ")[1:]} <= {*PROGRESS.phrases}
    if width >= 80:
        assert "garl [##--------]  4/16 flights  24 s left  I:2 IV:1" in line or width >= 100


def test_the_line_follows_the_forecast_once_there_is_one() -> None:
    done = SearchProgress(system="m:A", map="court", flown=4, all=4, generation=0)
    shrinking = RunProgress(
        searches=[done],
        kinds={"IV": 3},
        nearest={},
        seconds=8.0,
        flown_after=2,
        expected_after=12,
        left_s=33,
    )
    assert progress_line(shrinking, 79) == (
        "garl [###-------]  6/16 flights  33 s left  IV:3  confirming and shrinking"
    )


@PARALLEL
def test_lf_flies_exactly_the_failing_slots_again(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    args = ("--garl-budget=24", "--garl-shrink=0", "--garl-workers=1", "-rf", *parallel)

    def failed(result: pytest.RunResult) -> set[str]:
        return {line.split(" - ")[0] for line in result.outlines if line.startswith("FAILED")}

    first = failed(pytester.runpytest_subprocess(*args))
    assert len(first) == 2
    result = pytester.runpytest_subprocess(*args, "--lf")
    result.assert_outcomes(failed=2)
    assert failed(result) == first
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    flown = {each.id.slot_id for each in ledger.queries.flights()}
    ledger.close()
    assert flown == {re.findall(r"\[(.+)\]", line)[0] for line in first}


@PARALLEL
def test_junit_carries_what_was_found(pytester: pytest.Pytester, parallel: tuple[str, ...]) -> None:
    project(pytester)
    run(pytester, "--garl-budget=8", "--garl-workers=1", "--junitxml=out.xml", *parallel)
    cases = list(ElementTree.parse(Path(pytester.path) / "out.xml").iter("testcase"))
    assert len(cases) == 24
    for case in cases:
        found = {each.get("name"): each.get("value", "") for each in case.iter("property")}
        assert set(found) == {
            "garl.slot",
            "garl.outcome",
            "garl.signature",
            "garl.story",
            "garl.final_distance_m",
            "garl.elapsed_s",
            "garl.trajectory_sha256",
        }
        assert f"[{found['garl.slot']}]" in str(case.get("name"))
        assert float(found["garl.elapsed_s"]) == 14.2
        assert found["garl.trajectory_sha256"]


def test_the_line_tells_of_shrinking_and_goes(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    written = on_a_terminal(
        pytester, "--garl-budget=8", "--garl-shrink=12", "--garl-workers=1", "-q"
    )
    assert "garl: confirming and shrinking" in written
    # The forecast leaves no room for more on so narrow a terminal.
    assert re.search(r"garl \[#+-*\]  \d+/\d+ flights  \d+ s left", written)
    after = "\n".join(screen(written))
    assert "saved scenarios/regressions/slow/lawn-" in after.replace("\n", "")
    assert not LINE.search(after)


@PARALLEL
def test_a_log_shows_that_the_run_lives(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    slow_project(pytester)
    pytester.makeconftest(
        "from tiny_simulator import fly\n"
        "import pytest_garl.plugin.progress as progress\n"
        "progress.LOG_PERIOD_S = 0.1\n"
        "def pytest_garl_fly(config): return fly\n"
    )
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", "--garl-budget=4", "--garl-workers=1", "-q", *parallel
    )
    lines = [line for line in result.outlines if LINE.match(line)]
    assert len(lines) > 1
    told = [line for line in result.outlines if re.search(r"garl(:| \[)", line)]
    assert all(line.startswith(("garl", "---", "===")) for line in told)
    assert all(len(line) <= 80 for line in lines)
    assert "\x1b" not in result.stdout.str()


def test_the_search_tells_its_time_and_that_of_a_new_kind(pytester: pytest.Pytester) -> None:
    project(pytester, maps="['lawn', 'court']")
    args = ("--garl-budget=8", "--garl-workers=1", "-k", "test_collisions")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *args)
    result.stdout.fnmatch_lines(
        [
            "garl: * 1 worker; about 18 s per system and map, then about 20 s per new kind of *",
            "garl: 2 searches, about 35 s, then about 20 s per new kind of violation",
            "garl: confirming and shrinking 4 new kinds of violation, at most * flights, about * s",
        ]
    )
