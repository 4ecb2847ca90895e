"""Show the progress of a run: a line below pytest's own output, or a line now and then.

``show_progress`` decides who writes when; ``ProgressReader`` reads the ledger, and
``progress_line`` makes the line of it.
"""

from __future__ import annotations

import dataclasses
import os
import sqlite3
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.kind_news import KindNews, news_of
from pytest_garl.plugin.terminal.time_left import TimeLeft
from pytest_garl.plugin.terminal_text import counted, duration, write_lines
from pytest_garl.plugin.termination import ControllerWatch
from pytest_garl.plugin.xdist import is_xdist_worker

REFRESH_S = 0.5
LOG_PERIOD_S = 30.0
"""Without a terminal a line is written at this interval: enough to see that the run is alive."""
_MARGINS = ("collision", "distance", "time")
"""Properties whose nearest approach to a violation the line shows."""


@contextmanager
def show_progress(run: Run, config: pytest.Config) -> Iterator[None]:
    """Show the progress of a run while the block runs.

    On a terminal it is one line.  A process that runs items draws it only while it waits for a
    flight, when nobody else writes.  xdist's controller runs no item; there a thread draws, and
    removes the line while pytest writes.  Without a terminal a line is written now and then.
    """
    if is_xdist_worker(config):
        with _call_on_wait(run, ControllerWatch().look, lambda: None):
            yield
        return
    with _progress_and(news_of(run, config), run, config):
        yield


@contextmanager
def _progress_and(news: KindNews, run: Run, config: pytest.Config) -> Iterator[None]:
    """Show progress, and news above it, in the process that writes."""
    if not _is_terminal():
        log = ProgressLog(run, config)
        refresh = _both(news.write, log.refresh)
        with _call_on_wait(run, refresh, lambda: None), _call_on_reports(run, config):
            yield
    elif config.pluginmanager.hasplugin("dsession"):
        line = TerminalLine(run)
        thread = LineThread(line)
        drawing = thread.drawing(run.ledger.path, config)
        above = _call_on_wait(run, partial(thread.write_above, news), lambda: None)
        with closing(line), drawing, above, _call_on_reports(run, config):
            yield
    elif run.options.workers == 0:
        # The system flies in this process, where it may print or stop in a debugger.
        with _call_on_wait(run, news.write, lambda: None):
            yield
    else:
        line = TerminalLine(run, news)
        with closing(line), _call_on_wait(run, line.refresh, line.clear):
            yield


def _both(
    first: Callable[[Ledger], None], second: Callable[[Ledger], None]
) -> Callable[[Ledger], None]:
    def refresh(ledger: Ledger) -> None:
        first(ledger)
        second(ledger)

    return refresh


@contextmanager
def _call_on_wait(
    run: Run, refresh: Callable[[Ledger], None], clear: Callable[[], None]
) -> Iterator[None]:
    """Call ``refresh`` while the run waits for a flight, and ``clear`` when it has come."""
    before = run.on_wait, run.on_wait_end
    run.on_wait, run.on_wait_end = partial(refresh, run.ledger), clear
    try:
        yield
    finally:
        run.on_wait, run.on_wait_end = before


@contextmanager
def _call_on_reports(run: Run, config: pytest.Config) -> Iterator[None]:
    """Call ``run.on_wait`` at each report in xdist's controller, which waits for no flight."""

    class ReportListener:
        @pytest.hookimpl(trylast=True)
        def pytest_runtest_logreport(self) -> None:
            run.on_wait()

    if not config.pluginmanager.hasplugin("dsession"):
        yield
        return
    listener = ReportListener()
    config.pluginmanager.register(listener)
    try:
        yield
    finally:
        config.pluginmanager.unregister(listener)


def _is_terminal() -> bool:
    """Return whether this process has a terminal that understands how the line is drawn."""
    return sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"


class ProgressLog:
    """Writes a line now and then if there is no terminal to draw on."""

    def __init__(self, run: Run, config: pytest.Config) -> None:
        self._config, self._reader = config, ProgressReader(run, LOG_PERIOD_S)
        self._reader.start_clock()

    def refresh(self, ledger: Ledger) -> None:
        """Write a line if it is time."""
        progress = self._reader.read(ledger)
        if progress is not None:
            write_lines(self._config, lambda width: [progress_line(progress, width)])


class TerminalLine:
    """One line below the cursor, on a copy of standard output that pytest does not capture."""

    def __init__(self, run: Run, news: KindNews | None = None) -> None:
        self._news = news
        self._terminal = os.dup(sys.stdout.fileno())
        self._reader = ProgressReader(run, REFRESH_S)
        self._progress: RunProgress | None = None
        self._visible = False

    def refresh(self, ledger: Ledger) -> None:
        """Draw the line if it is not visible or out of date; write news above it."""
        if self._news and (lines := self._news.lines(ledger)):
            self.clear()
            self._news.show(lines)
        if self.read(ledger) or not self._visible:
            self.draw()

    def read(self, ledger: Ledger) -> bool:
        """Read the progress if it is time; return whether it was."""
        progress = self._reader.read(ledger)
        self._progress = progress or self._progress
        return progress is not None

    def draw(self) -> None:
        """Draw the progress that was read last."""
        if self._progress is not None:
            # Make room below without leaving the column, save the place, write, come back.
            columns = os.get_terminal_size(self._terminal).columns or 80
            line = progress_line(self._progress, columns - 1)[: columns - 1]
            self._write(f"\x1bD\x1bM\x1b7\r\n{line}\x1b[J\x1b8")
            self._visible = True

    def clear(self) -> None:
        """Remove the line, also if a resized terminal has wrapped it."""
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


class LineThread:
    """Draws the line from a thread in xdist's controller."""

    def __init__(self, line: TerminalLine) -> None:
        self._line = line
        self._lock = threading.RLock()
        self._stop = threading.Event()
        self._given_up = False
        self._hidden = 0

    def write_above(self, news: KindNews, ledger: Ledger) -> None:
        """Write the news that are due while the line is not visible."""
        with self._without_line():
            news.write(ledger)

    @contextmanager
    def drawing(self, ledger: Path, config: pytest.Config) -> Iterator[None]:
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
    def _hide_while_pytest_writes(self) -> Generator[None, Any, Any]:
        with self._without_line():
            return (yield)

    @contextmanager
    def _without_line(self) -> Iterator[None]:
        with self._lock:
            self._line.clear()
            self._hidden += 1
            try:
                yield
            finally:
                self._hidden -= 1
                self._redraw()

    pytest_runtest_logstart = _hide_while_pytest_writes
    pytest_runtest_logreport = _hide_while_pytest_writes
    pytest_runtest_logfinish = _hide_while_pytest_writes

    @pytest.hookimpl(tryfirst=True, optionalhook=True)
    def pytest_testnodedown(self, error: object) -> None:
        """Draw no more once a worker died, because xdist then writes outside of any hook."""
        if error:
            self._give_up()

    @pytest.hookimpl(tryfirst=True)
    def pytest_internalerror(self) -> None:
        """Draw no more."""
        self._give_up()

    def _give_up(self) -> None:
        with self._lock:
            self._given_up = True
            self._line.clear()

    def _redraw(self) -> None:
        if not self._given_up and not self._hidden:
            self._line.draw()


@dataclass(frozen=True, slots=True, kw_only=True)
class RunProgress:
    """The progress of a run: its searches, the flights that follow them, and what was found."""

    searches: Sequence[SearchProgress]
    kinds: Mapping[str, int]
    """How many violations of each type were found."""
    nearest: Mapping[str, tuple[float, str]]
    """The smallest margin of each property, with its unit."""
    flights_per_s: float | None = None
    """How fast they are flown; None before two readings."""
    selected: int = 0
    """Flights that the selected tests need, those of searches that have not begun included."""
    flown_after: float = 0
    """Flights flown beside the searches, to repeat, confirm and shrink violations."""
    expected_after: float = 0
    """Flights expected beside the searches, those flown included."""
    left_s: float | None = None
    """A forecast of the time left; None before enough was flown."""
    after_search: bool = False
    """Whether the searches are over, so that what is left follows them."""
    least_share: float = 0.0
    """The share of the work that the bar has shown already."""
    shrinks: bool = True
    """Whether kinds are confirmed and shrunk; if not, their violations are flown again only."""
    investigated: int = 0
    """Kinds of violation that are confirmed and shrunk beside the search at the moment."""

    @property
    def flown(self) -> float:
        """How many flights have been flown."""
        return self._searched + self.flown_after

    @property
    def total(self) -> float:
        """How many flights of searches and beside them are expected."""
        return self._wanted + self._after

    @property
    def share(self) -> float:
        """The share of the expected flights that has been flown, never less than was shown."""
        return max(self.least_share, self.flown / self.total if self.total else 0.0)

    @property
    def _searched(self) -> int:
        return sum(each.flown for each in self.searches)

    @property
    def _wanted(self) -> int:
        return max(self.selected, sum(each.total for each in self.searches))

    @property
    def _after(self) -> float:
        return max(self.expected_after, self.flown_after)

    @property
    def phrases(self) -> list[str]:
        """The parts of the line, the most important first."""
        # Each new kind adds flights to shrink it, so that one total of all would jump.
        purpose = "shrinking" if self.shrinks else "repeating"
        after = f", {purpose} {self.flown_after:.0f}/~{self._after:.0f}" if self._after else ""
        phrases = [f"{self._searched}/{self._wanted} flights{after}"]
        if self.left_s is not None:
            phrases.append(f"{duration(self.left_s)} left")
        if self.kinds:
            phrases.append(" ".join(f"{kind}:{count}" for kind, count in self.kinds.items()))
        flying = next((each for each in self.searches if each.flown < each.total), None)
        if flying:
            where = f"{flying.system.split(':')[-1]} on {flying.map}"
            phrases.append(f"{where} g{flying.generation:02d} {flying.flown}/{flying.total}")
            if self.investigated:
                phrases.append(f"shrinking {counted(self.investigated, 'kind')} beside it")
        elif self.after_search:
            phrases.append("confirming and shrinking" if self.shrinks else "repeating")
        if self.flights_per_s is not None:
            phrases.append(f"{self.flights_per_s:.2f} flights/s")
        margins = [
            f"{name} {self.nearest[name][0]:.2g} {self.nearest[name][1]}"
            for name in _MARGINS
            if name in self.nearest
        ]
        if margins:
            phrases.append("nearest " + ", ".join(margins))
        return phrases


def progress_line(progress: RunProgress, width: int) -> str:
    """Return a bar, then as many whole phrases as there is room for."""
    cells = 20 if width >= 100 else 10
    full = int(cells * progress.share)
    line = f"garl [{'#' * full}{'-' * (cells - full)}]"
    for phrase in progress.phrases:
        if len(line) + 2 + len(phrase) > width:
            # A later phrase matters less, but may be shorter.
            continue
        line += f"  {phrase}"
    return line


class ProgressReader:
    """Reads the progress of a run from a ledger, at most once in ``every_s`` seconds."""

    def __init__(self, run: Run, every_s: float) -> None:
        self._run, self._every_s = run, every_s
        self._last_read = 0.0
        self._first: tuple[float, float] | None = None
        self._time_left, self._share = TimeLeft(run), 0.0

    def start_clock(self) -> None:
        """Read nothing for ``every_s`` seconds."""
        self._last_read = time.monotonic()

    def read(self, ledger: Ledger) -> RunProgress | None:
        """Return the progress if it is time to show it, and if there is any."""
        now = time.monotonic()
        if now - self._last_read < self._every_s:
            return None
        self._last_read = now
        queries = ledger.queries
        searches, selected = queries.progress(), ledger.facts.selected
        if not searches:
            return None
        forecast = self._time_left.forecast(ledger, now)
        investigations = self._run.investigations
        progress = RunProgress(
            searches=searches,
            kinds=queries.violation_counts(),
            nearest=queries.nearest(),
            selected=selected,
            flown_after=queries.meters().get("on_demand", 0),
            expected_after=forecast.flights_after,
            left_s=forecast.left_s,
            after_search=self._run.remaining is not None,
            shrinks=self._run.options.shrink > 0,
            investigated=investigations.running if investigations else 0,
        )
        # The expected number grows with each new kind; the bar does not go back.
        self._share = max(self._share, progress.share)
        return dataclasses.replace(
            progress, least_share=self._share, flights_per_s=self._rate(progress.flown, now)
        )

    def _rate(self, flown: float, now: float) -> float | None:
        """Return the flights per second since the first reading: a run may continue another."""
        if self._first is None:
            self._first = now, flown
        began, before = self._first
        return (flown - before) / (now - began) if now > began and flown > before else None
