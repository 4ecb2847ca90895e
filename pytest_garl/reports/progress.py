"""The live progress line below pytest's own output."""

from __future__ import annotations

import os
import sqlite3
import sys
import threading
import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.run import Run
from pytest_garl.search.ledger import Ledger, Progress

REFRESH_S = 0.5


@contextmanager
def live(run: Run, config: pytest.Config) -> Iterator[None]:
    """Show the line while the tests run, where standard output is a terminal.

    A process that runs items draws only while it waits for a flight, when nobody else writes.
    xdist's controller runs no item; there a thread draws, and steps aside when pytest writes.
    """
    if not _shown(config):
        yield
    elif config.pluginmanager.hasplugin("dsession"):
        with closing(Line()) as line, Watch(line).watching(run.ledger.path, config):
            yield
    elif run.options.workers == 0:
        # The system flies in this process, where it may print or stop in a debugger.
        yield
    else:
        with closing(Line()) as line:
            before = run.tick, run.waited
            run.tick, run.waited = partial(line.refresh, run.ledger), line.clear
            try:
                yield
            finally:
                run.tick, run.waited = before


def text(
    searches: Sequence[Progress],
    kinds: Mapping[str, int],
    nearest: Mapping[str, tuple[float, str]],
    s: float,
) -> str:
    """Return the line's words after ``s`` seconds, what matters most first."""
    flown, total = sum(each.flown for each in searches), sum(each.all for each in searches)
    words = [f"garl: {flown}/{total} flown"]
    if 0 < flown < total:
        words.append(f"{duration((total - flown) * s / flown)} left")
    if kinds:
        words.append(" ".join(f"{kind}:{count}" for kind, count in kinds.items()))
    flying = next((each for each in searches if each.flown < each.all), None)
    if flying:
        where = f"{flying.system.split(':')[-1]} on {flying.map}"
        words.append(f"{where} g{flying.generation:02d} {flying.flown}/{flying.all}")
    if flown and s > 0:
        words.append(f"{flown / s:.2f} flights/s")
    margins = [f"{name} {nearest[name][0]:.2g} {nearest[name][1]}" for name in _SHOWN & {*nearest}]
    if margins:
        words.append("nearest " + ", ".join(sorted(margins)))
    return "  ".join(words)


def duration(seconds: float) -> str:
    """Return a duration in words."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


_SHOWN = {"distance", "time", "collision"}


def _shown(config: pytest.Config) -> bool:
    """Say whether this process has a terminal that understands how the line is drawn."""
    worker = hasattr(config, "workerinput")
    return not worker and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


class Line:
    """One line below the cursor, on a copy of standard output that pytest does not capture."""

    def __init__(self) -> None:
        self._terminal = os.dup(sys.stdout.fileno())
        self._began = self._read = 0.0
        self._text = ""
        self._visible = False

    def refresh(self, ledger: Ledger) -> None:
        """Draw the line if it is not there, or old."""
        if self.read(ledger) or not self._visible:
            self.draw()

    def read(self, ledger: Ledger) -> bool:
        """Read the ledger again if it is time; say whether it was."""
        now = time.monotonic()
        if now - self._read < REFRESH_S:
            return False
        self._read = now
        searches = ledger.progress()
        if not searches:
            return True
        self._began = self._began or now
        if all(each.flown == each.all for each in searches):
            errands = ledger.meters().get("errands", 0)
            self._text = f"garl: {errands:.0f} flights to confirm and shrink what was found"
        else:
            self._text = text(searches, ledger.violations(), ledger.nearest(), now - self._began)
        return True

    def draw(self) -> None:
        """Draw what was read last."""
        if self._text:
            # Make room below without leaving the column, save the place, write, come back.
            columns = os.get_terminal_size(self._terminal).columns or 80
            self._write(f"\x1bD\x1bM\x1b7\r\n{self._text[: columns - 1]}\x1b[J\x1b8")
            self._visible = True

    def clear(self) -> None:
        """Remove the line, and whatever a resized terminal made of it."""
        if self._visible:
            self._write("\x1b[J")
            self._visible = False

    def close(self) -> None:
        """Remove the line for good."""
        self.clear()
        os.close(self._terminal)

    def _write(self, text: str) -> None:
        sys.stdout.flush()
        os.write(self._terminal, text.encode())


class Watch:
    """Draws the line from a thread in xdist's controller."""

    def __init__(self, line: Line) -> None:
        self._line = line
        self._lock = threading.RLock()
        self._stop = threading.Event()
        self._quiet = False

    @contextmanager
    def watching(self, ledger: Path, config: pytest.Config) -> Iterator[None]:
        """Draw until the block ends."""
        thread = threading.Thread(target=self._draw, args=(ledger,), daemon=True)
        config.pluginmanager.register(self)
        thread.start()
        try:
            yield
        finally:
            self._stop.set()
            thread.join()
            config.pluginmanager.unregister(self)

    def _draw(self, path: Path) -> None:
        try:
            with closing(Ledger(path)) as ledger:
                while not self._stop.wait(REFRESH_S):
                    self._line.read(ledger)
                    with self._lock:
                        self._redraw()
        except (LedgerError, sqlite3.Error, OSError):
            return  # a session without the line is better than none

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def _step_aside(self) -> Generator[None, Any, Any]:
        with self._lock:
            self._line.clear()
            try:
                return (yield)
            finally:
                self._redraw()

    pytest_runtest_logstart = pytest_runtest_logreport = pytest_runtest_logfinish = _step_aside

    @pytest.hookimpl(tryfirst=True, optionalhook=True)
    def pytest_testnodedown(self, error: object) -> None:
        """Do without the line once a worker died: xdist then writes outside of any hook."""
        if error:
            self._give_up()

    @pytest.hookimpl(tryfirst=True)
    def pytest_internalerror(self) -> None:
        """Do without the line from here on."""
        self._give_up()

    def _give_up(self) -> None:
        with self._lock:
            self._quiet = True
            self._line.clear()

    def _redraw(self) -> None:
        if not self._quiet:
            self._line.draw()
