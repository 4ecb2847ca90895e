"""How many flights follow the searches, and how long the rest of the run takes.

Nothing is forecast before some flights were flown: a flight takes 1 s with one landing system and
10 s with another one, and half or twice as long on another machine.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import FlightSeconds
from pytest_garl.plugin.session.run import Run
from pytest_garl.triage.forecast import RemainingWork, expected_kinds, flights_after_search

FIRST_FLIGHTS = 20
"""The time left is forecast after this number of flights.  After eight flights, two searches of
forty had shown no kind; they found sixteen, and took 3.9 times as long as forecast then."""
_FAILING_TIMES, _FAILING_FLIGHTS = 2.0, 2
"""Until flights have failed, a failing flight is expected to take the first number times as long
as a landing; this expectation weighs as much as the second number of measured flights."""
_ENOUGH_AFTER = 4
"""After this many flights beyond the search, the rest is forecast from their time."""
_LEAST_BUSY = 0.5
"""At least this share of workers is counted as busy: fewer are only while a search begins."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Forecast:
    """What is left of a run.

    ``flights_after`` is the expected number of flights after the searches, flown ones included.
    ``left_s`` is None while it cannot be forecast.
    """

    flights_after: float
    left_s: float | None


class NewKinds:
    """Finds the kinds of violation in a run that no saved case expects."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._known: dict[str, frozenset[str]] = {}

    def found(self, ledger: Ledger) -> list[tuple[str, str]]:
        """Return search and signature of each such kind found so far."""
        return [
            (search, signature)
            for search, signature in ledger.queries.seconds_by_signature()
            if signature not in self._known_in(ledger, search)
        ]

    def _known_in(self, ledger: Ledger, search: str) -> frozenset[str]:
        """Return the kinds that saved cases of a search's system and map expect."""
        if search not in self._known:
            text = ledger.job(search)
            assert text is not None, "a flight's search has a job"
            job = parse_job(text)
            corpus = self._run.corpus
            self._known[search] = frozenset(corpus.expected_signatures(job.system.name, job.map))
        return self._known[search]


class TimeLeft:
    """Forecasts a run from the flights flown so far."""

    def __init__(self, run: Run) -> None:
        self._run, self._kinds = run, NewKinds(run)
        self._began: float | None = None
        self._flying_before_s = 0.0
        self._remaining: RemainingWork | None = None
        self._remaining_since = self._flown_then = 0.0

    def forecast(self, ledger: Ledger, now: float) -> Forecast:
        """Return what is left at the time ``now``, in seconds; the first call starts the clock."""
        flown = ledger.queries.meters()
        after, flying_s = flown.get("on_demand", 0.0), flown.get("flying_s", 0.0)
        if self._began is None:
            self._began, self._flying_before_s = now, flying_s
        if self._run.remaining is not None:
            return self._after_search(self._run.remaining, after, now)
        queries = ledger.queries
        searches = queries.progress()
        searched = sum(each.flown for each in searches)
        wanted = max(ledger.facts.selected, sum(each.total for each in searches))
        expected = max(after, self._flights_after(ledger, searched, wanted))
        seconds = queries.flight_seconds()
        if searched + after < FIRST_FLIGHTS:
            return Forecast(flights_after=expected, left_s=None)
        # Flights that shrink a violation take as long as flights that fail.
        work_s = (wanted - searched) * seconds.of_search + (expected - after) * _failing_s(seconds)
        workers = self._busy_workers(flying_s, now)
        left_s = work_s / workers if workers else None
        return Forecast(flights_after=expected, left_s=left_s)

    def _flights_after(self, ledger: Ledger, searched: int, wanted: int) -> float:
        """Return how many flights will confirm and shrink the kinds of all searches."""
        options = self._run.options
        cap = options.budget if options.shrink_capped else None
        found = Counter(search for search, _ in self._kinds.found(ledger))
        searches = max(1, round(wanted / options.budget)) if options.budget else 1
        # Searches that have not begun find as many kinds as the others.
        in_all = expected_kinds(found.total(), searched, wanted)
        each = in_all / searches
        return searches * flights_after_search(each, options.shrink, cap)

    def _busy_workers(self, flying_s: float, now: float) -> float:
        """Return how many workers fly at a time; 0 if that is unknown."""
        assert self._began is not None
        passed_s, workers = now - self._began, self._run.options.workers
        flew_s = flying_s - self._flying_before_s
        busy = flew_s / passed_s if passed_s > 0 else 0.0
        if workers is None:
            return busy
        return min(max(busy, _LEAST_BUSY * max(1, workers)), max(1, workers))

    def _after_search(self, remaining: RemainingWork, after: float, now: float) -> Forecast:
        """Return what is left of the work after the searches."""
        if self._remaining is None:
            self._remaining, self._remaining_since, self._flown_then = remaining, now, after
        done, passed_s = after - self._flown_then, now - self._remaining_since
        left = max(0.0, self._remaining.flights - done)
        by_plan_s = max(0.0, self._remaining.seconds - passed_s)
        left_s = left * passed_s / done if done >= _ENOUGH_AFTER else by_plan_s
        return Forecast(
            flights_after=max(after, self._flown_then + self._remaining.flights),
            # None if the plan is used up: unplanned flights, or planned ones that took longer.
            left_s=left_s or None,
        )


def _failing_s(seconds: FlightSeconds) -> float:
    """Return the expected time of a flight that fails: one that never lands flies to its limit."""
    plain = seconds.plain or seconds.of_search
    count = _FAILING_FLIGHTS + seconds.failing_count
    before = _FAILING_FLIGHTS * _FAILING_TIMES * plain
    return (before + seconds.failing_count * seconds.failing) / count
