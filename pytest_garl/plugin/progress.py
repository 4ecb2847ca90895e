"""How far a run is: a line below pytest's own output, or one now and then."""

from __future__ import annotations

import os
import sqlite3
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.plugin.keys import is_xdist_worker
from pytest_garl.plugin.run import SELECTED, Run
from pytest_garl.plugin.wrapping import begin_line, width_of
from pytest_garl.regressions.forecast import RemainingWork, flights_after_search

REFRESH_S = 0.5
BEAT_S = 30.0
"""Where there is no terminal, a line is written so often: enough to see that the run lives."""


@contextmanager
def live(run: Run, config: pytest.Config) -> Iterator[None]:
    """Show how far the run is while the tests run.

    On a terminal it is a line.  A process that runs items draws only while it waits for a flight,
    when nobody else writes.  xdist's controller runs no item; there a thread draws, and steps aside
    when pytest writes.  Elsewhere a line is written now and then.
    """
    if is_xdist_worker(config):
        yield
    elif not _is_terminal():
        with _ticking(run, Beat(run, config).refresh, lambda: None), _reporting(run, config):
            yield
    elif config.pluginmanager.hasplugin("dsession"):
        with closing(Line(run)) as line, Watch(line).watching(run.ledger.path, config):
            yield
    elif run.options.workers == 0:
        # The system flies in this process, where it may print or stop in a debugger.
        yield
    else:
        with closing(Line(run)) as line, _ticking(run, line.refresh, line.clear):
            yield


@contextmanager
def _ticking(
    run: Run, refresh: Callable[[Ledger], None], clear: Callable[[], None]
) -> Iterator[None]:
    """Have something done while a flight is waited for, and when it has come."""
    before = run.on_wait, run.on_wait_end
    run.on_wait, run.on_wait_end = partial(refresh, run.ledger), clear
    try:
        yield
    finally:
        run.on_wait, run.on_wait_end = before


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """How far a run is: the searches, the flights that follow them, and what was found."""

    searches: Sequence[SearchProgress]
    kinds: Mapping[str, int]
    nearest: Mapping[str, tuple[float, str]]
    seconds: float
    """Since flying began."""
    selected: int = 0
    """Flights that the selected tests want, of searches that have not begun as well."""
    beside: float = 0
    """Flights flown beside the searches."""
    expected: float = 0
    """Flights expected beside the searches, those flown included."""
    left_s: float | None = None
    """A forecast of what is left, where there is a better one than the mean."""

    @property
    def flown(self) -> float:
        """Flights of all kinds."""
        return sum(each.flown for each in self.searches) + self.beside

    @property
    def all(self) -> float:
        """The one total: the searches' flights, and those that are expected beside them."""
        wanted = max(self.selected, sum(each.all for each in self.searches))
        return wanted + max(self.expected, self.beside)

    @property
    def words(self) -> list[str]:
        """What is to be said, what matters most first."""
        words = [f"{self.flown:.0f}/{self.all:.0f} flights"]
        left_s = self.left_s
        if left_s is None and self.seconds > 0 and 0 < self.flown < self.all:
            left_s = (self.all - self.flown) * self.seconds / self.flown
        if left_s is not None:
            words.append(f"{duration(left_s)} left")
        if self.kinds:
            words.append(" ".join(f"{kind}:{count}" for kind, count in self.kinds.items()))
        flying = next((each for each in self.searches if each.flown < each.all), None)
        if flying:
            where = f"{flying.system.split(':')[-1]} on {flying.map}"
            words.append(f"{where} g{flying.generation:02d} {flying.flown}/{flying.all}")
        elif self.left_s is not None:
            words.append("confirming and shrinking")
        if self.flown and self.seconds > 0:
            words.append(f"{self.flown / self.seconds:.2f} flights/s")
        margins = [
            f"{name} {self.nearest[name][0]:.2g} {self.nearest[name][1]}"
            for name in sorted(_SHOWN & {*self.nearest})
        ]
        if margins:
            words.append("nearest " + ", ".join(margins))
        return words


def text(stand: Stand, width: int) -> str:
    """Return the line: a bar, then as many words as there is room for, none of them cut."""
    cells = 20 if width >= 100 else 10
    full = int(cells * stand.flown / stand.all) if stand.all else 0
    line = f"garl [{'#' * full}{'-' * (cells - full)}]"
    for word in stand.words:
        if len(line) + 2 + len(word) > width:
            # What comes later matters less, but may be shorter.
            continue
        line += f"  {word}"
    return line


def duration(seconds: float) -> str:
    """Return a duration in words."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


_SHOWN = {"distance", "time", "collision"}


def _is_terminal() -> bool:
    """Say whether this process has a terminal that understands how the line is drawn."""
    return sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


class Reader:
    """Reads now and then from a ledger how far a run is."""

    def __init__(self, run: Run, every_s: float) -> None:
        self._run, self._every_s = run, every_s
        self._read = self._began = self._rest_began = 0.0
        self._expected = 0.0
        self._rest: RemainingWork | None = None

    def wait(self) -> None:
        """Say nothing at first; what is flown meanwhile counts for the forecast."""
        self._began = self._read = time.monotonic()

    def read(self, ledger: Ledger) -> Stand | None:
        """Return how far the run is if it is time to say so, and if there is anything to say."""
        now = time.monotonic()
        if now - self._read < self._every_s:
            return None
        self._read = now
        searches = ledger.queries.progress()
        if not searches:
            return None
        self._began = self._began or now
        beside = ledger.queries.meters().get("on_demand", 0)
        left_s = None
        if self._run.rest is None:
            options = self._run.options
            cap = options.budget if options.shrink_capped else None
            new = Counter(search for search, _ in ledger.queries.kinds())
            self._expected = sum(
                flights_after_search(each, options.shrink, cap) for each in new.values()
            )
        else:
            if self._rest is None:
                self._rest, self._rest_began = self._run.rest, now
                self._expected = beside + self._rest.flights
            left_s = max(0.0, self._rest.seconds - (now - self._rest_began))
        return Stand(
            searches=searches,
            kinds=ledger.queries.violations(),
            nearest=ledger.queries.nearest(),
            seconds=now - self._began,
            selected=int(ledger.fact(SELECTED) or 0),
            beside=beside,
            expected=self._expected,
            left_s=left_s,
        )


class Beat:
    """Writes a line of its own now and then, where there is no terminal to draw on."""

    def __init__(self, run: Run, config: pytest.Config) -> None:
        self._config, self._reader = config, Reader(run, BEAT_S)
        self._reader.wait()

    def refresh(self, ledger: Ledger) -> None:
        """Write a line if it is time."""
        stand = self._reader.read(ledger)
        reporter: Any = self._config.pluginmanager.get_plugin("terminalreporter")
        if stand is None or reporter is None:
            return
        capture: Any = self._config.pluginmanager.get_plugin("capturemanager")
        with capture.global_and_fixture_disabled() if capture else nullcontext():
            begin_line(reporter)
            reporter.write_line(text(stand, width_of(self._config)))


@contextmanager
def _reporting(run: Run, config: pytest.Config) -> Iterator[None]:
    """Have the time looked at whenever xdist's controller hears of a test: it waits for none."""

    class Hears:
        @pytest.hookimpl(trylast=True)
        def pytest_runtest_logreport(self) -> None:
            run.on_wait()

    if not config.pluginmanager.hasplugin("dsession"):
        yield
        return
    hears = Hears()
    config.pluginmanager.register(hears)
    try:
        yield
    finally:
        config.pluginmanager.unregister(hears)


class Line:
    """One line below the cursor, on a copy of standard output that pytest does not capture."""

    def __init__(self, run: Run) -> None:
        self._terminal = os.dup(sys.stdout.fileno())
        self._reader = Reader(run, REFRESH_S)
        self._stand: Stand | None = None
        self._visible = False

    def refresh(self, ledger: Ledger) -> None:
        """Draw the line if it is not there, or old."""
        if self.read(ledger) or not self._visible:
            self.draw()

    def read(self, ledger: Ledger) -> bool:
        """Read the ledger again if it is time; say whether it was."""
        stand = self._reader.read(ledger)
        self._stand = stand or self._stand
        return stand is not None

    def draw(self) -> None:
        """Draw what was read last."""
        if self._stand is not None:
            # Make room below without leaving the column, save the place, write, come back.
            columns = os.get_terminal_size(self._terminal).columns or 80
            line = text(self._stand, columns - 1)[: columns - 1]
            self._write(f"\x1bD\x1bM\x1b7\r\n{line}\x1b[J\x1b8")
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
