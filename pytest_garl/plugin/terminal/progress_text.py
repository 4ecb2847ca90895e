"""The progress of a run, read from the ledger and put into one line."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.time_left import TimeLeft
from pytest_garl.plugin.terminal_text import counted, duration

_MARGINS = ("collision", "distance", "time")
"""Properties whose nearest approach to a violation the line shows."""


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
