"""While a search runs: a sentence when a new kind of violation is found or shrunk."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator

import pytest

from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.ledger import Ledger
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.time_left import NewKinds, TimeLeft
from pytest_garl.plugin.terminal_text import duration, wrapped, write_lines
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.verdicts.wording import headline

PERIOD_S = 1.0
"""The ledger is read at this interval: a flight takes longer."""
_NEWS = pytest.StashKey["KindNews"]()
"""Where a session keeps which new kinds were announced."""


class KindNews:
    """Writes what was found and shrunk since it wrote last, each kind once.

    A kind that a saved case knows is not new.
    """

    def __init__(self, run: Run, config: pytest.Config) -> None:
        self._run, self._config = run, config
        self._looked = 0.0
        self._found: set[tuple[str, str]] = set()
        self._shrunk: set[str] = set()
        self._tells_saving = False
        self._told: set[str] = set()
        self._kinds, self._time_left = NewKinds(run), TimeLeft(run)
        self._tells_time = run.flight_s is None
        options = run.options
        self._earlier = set(self._kinds.found(run.ledger)) if options.resume else set()
        quiet = config.get_verbosity() < 0
        self._is_wanted = bool(options.budget) and not options.repeat and not quiet

    def lines(self, ledger: Ledger, *, at_once: bool = False) -> list[str]:
        """Return the sentences that are due; ``at_once`` although it has just looked."""
        now = time.monotonic()
        if not self._is_wanted or (now - self._looked < PERIOD_S and not at_once):
            return []
        self._looked = now
        time_left = [] if at_once else self._time(ledger, now)
        return [*self._new_kinds(ledger), *self._shrunk_kinds(), *time_left]

    def write(self, ledger: Ledger, *, at_once: bool = False) -> None:
        """Write the sentences that are due on lines of their own."""
        if lines := self.lines(ledger, at_once=at_once):
            self.show(lines)

    def show(self, lines: list[str]) -> None:
        """Write lines, also while pytest captures what a test prints."""
        write_lines(
            self._config, lambda width: (wrapped(line, width, others="  ") for line in lines)
        )

    def _new_kinds(self, ledger: Ledger) -> Iterator[str]:
        for search, signature in self._kinds.found(ledger):
            if (search, signature) in self._found:
                continue
            self._found.add((search, signature))
            flight = ledger.queries.first_of(search, signature)
            key = SearchKey(system=flight.system, map=flight.id.map)
            where = ledger.facts.search_names.get(search, key.place)
            what = headline(flight.result.verdict.story)
            # A run that goes on tells again what its first part found: its output may be lost.
            found = "found earlier" if (search, signature) in self._earlier else "found"
            yield f"garl: {found} {signature}: {what} ({where}, {flight.id.slot_id})"

    def _time(self, ledger: Ledger, now: float) -> Iterator[str]:
        """Yield the time left once, in a run whose header could not tell it."""
        if not self._tells_time:
            return
        forecast = self._time_left.forecast(ledger, now)
        if forecast.left_s is not None:
            self._tells_time = False
            shrinking = ", shrinking included" if self._run.options.shrink else ""
            yield f"garl: about {duration(forecast.left_s)} left{shrinking}"

    def _shrunk_kinds(self) -> Iterator[str]:
        investigations = self._run.investigations
        for request, result in investigations.results if investigations else ():
            if request.name not in self._shrunk:
                self._shrunk.add(request.name)
                text = _shrunk(request, result)
                # Another cause of a kind may have shrunk to the same case.
                if text not in self._told:
                    saved = result.case is not None and not self._tells_saving
                    self._tells_saving = self._tells_saving or saved
                    self._told.add(text)
                    yield f"{text} (its case is saved when the run ends)" if saved else text


def news_of(run: Run, config: pytest.Config) -> KindNews:
    """Return the news of a run, which tell each kind once."""
    return config.stash.setdefault(_NEWS, KindNews(run, config))


def write_last_news(run: Run, config: pytest.Config) -> None:
    """Write the sentences that are still due, in a session that has announced any."""
    if _NEWS in config.stash:
        config.stash[_NEWS].write(run.ledger, at_once=True)


def _shrunk(request: CaseRequest, result: CaseResult) -> str:
    """Return what is left of a kind when it is confirmed and shrunk."""
    name = f"{result.signature} ({request.job.system.name.split(':')[-1]} on {request.job.map})"
    if result.case is None:
        return f"garl: not confirmed {name}: {result.reason}"
    # The first sentences say what it takes and what happens; the summary shows them all.
    sentences = re.split(r"\.\s+(?=[A-Z])", result.case.violation.description)
    if result.case.is_shrunk:
        return f"garl: shrunk {name}: {sentences[0]}"
    if result.case.severity.is_guess:
        # Unusual values stand first; it is unknown which of them the violation takes.
        return f"garl: confirmed, not shrunk {name}: {'. '.join(sentences[:2])}".removesuffix(".")
    return f"garl: confirmed {name}: {sentences[0]}"
