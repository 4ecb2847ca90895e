"""The progress line on a terminal, and the log without one."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios

import pytest

from tests.support.landing_project import project

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


@pytest.mark.parametrize(
    "args", [("-q",), ("-v",), ("-q", "-n2"), pytest.param(("-v", "-n2"), marks=pytest.mark.long)]
)
def test_progress_line_appears_and_disappears(
    pytester: pytest.Pytester, args: tuple[str, ...]
) -> None:
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
def test_progress_line_is_absent_without_a_terminal_or_workers(
    pytester: pytest.Pytester, args: tuple[str, ...], term: str
) -> None:
    slow_project(pytester)
    written = on_a_terminal(pytester, "--garl-budget=2", "--garl-shrink=0", "-q", *args, term=term)
    assert "garl: violations" in written
    assert not re.search(r"garl \[", written)
    assert "\x1b7" not in written


def test_dead_worker_leaves_no_progress_line(pytester: pytest.Pytester) -> None:
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


def test_progress_line_shows_shrinking_and_disappears(pytester: pytest.Pytester) -> None:
    slow_project(pytester)
    search = ("--garl-budget=8", "--garl-shrink=8", "--garl-workers=1", "-k", "test_collisions")
    written = on_a_terminal(pytester, *search, "-q")
    assert "garl: confirming and shrinking" in written
    # The forecast leaves no room for more on so narrow a terminal.
    assert re.search(r"garl \[#+-*\]  \d+/\d+ flights, shrinking \d+/~\d+  \d+ s left", written)
    after = "\n".join(screen(written))
    assert "saved scenarios/regressions/slow/lawn-" in after.replace("\n", "")
    assert not LINE.search(after)


@PARALLEL
def test_log_gets_a_line_now_and_then(pytester: pytest.Pytester, parallel: tuple[str, ...]) -> None:
    slow_project(pytester)
    pytester.makeconftest(
        "from tiny_simulator import fly\n"
        "import pytest_garl.plugin.terminal.progress as progress\n"
        "progress.LOG_PERIOD_S = 0.1\n"
        "def pytest_garl_fly(config): return fly\n"
    )
    search = ("--garl-budget=4", "--garl-shrink=8", "--garl-workers=1", "-k", "test_collisions")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *search, "-q", *parallel)
    lines = [line for line in result.outlines if LINE.match(line)]
    assert len(lines) > 1
    garl_lines = [line for line in result.outlines if re.search(r"garl(:| \[)", line)]
    assert all(line.startswith(("garl", "---", "===")) for line in garl_lines)
    assert all(len(line) <= 80 for line in lines)
    assert "\x1b" not in result.stdout.str()
