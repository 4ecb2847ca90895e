"""The investigations of all new signatures of a run, beside the search and after it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path

from pytest_garl.cases.corpus import Corpus
from pytest_garl.cases.user_failure import UserAssertion
from pytest_garl.execution.database import BEFORE_SEARCHES, BEHIND_SEARCHES
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.on_demand import OnDemandFlights
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.execution.reference import simulator_sha256
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.shrinking.investigation import build_case
from pytest_garl.shrinking.new_case import case_without_flights
from pytest_garl.triage.allowance import Allowance, ShrinkBudget
from pytest_garl.triage.candidates import SearchSignature, case_requests
from pytest_garl.triage.forecast import RemainingWork, remaining_work
from pytest_garl.triage.further_causes import FurtherCauses
from pytest_garl.triage.known_kinds import Twin
from pytest_garl.triage.new_signatures import NewSignatures
from pytest_garl.triage.second_reading import case_of_finding

Requests = Sequence[CaseRequest]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Investigation:
    """An investigation that was started; ``request`` has the flights that it may take."""

    request: CaseRequest
    result: Future[CaseResult]

    @property
    def unspent(self) -> int:
        """How many of its flights it has left over, once it has ended."""
        return self.request.budget - self.result.result().flights


@dataclass(slots=True, kw_only=True)
class _OfSearch:
    """The investigations of one search, in the order in which they were started."""

    allowance: Allowance
    started: list[_Investigation] = field(default_factory=list)
    settled: int = 0
    """How many of them have given back what they left over."""

    def left_for(self, waiting: Requests) -> int | None:
        """Return how many flights those that wait may have, without what others may leave over."""
        if self.allowance.left is None:
            return None
        ended = [each for each in self.started[self.settled :] if each.result.done()]
        left = self.allowance.left + sum(each.unspent for each in ended)
        return max(left, self.allowance.offer(waiting[0])) if waiting else left

    def settle_next(self) -> bool:
        """Take back what the next investigation left over; return whether it has ended."""
        if self.settled == len(self.started) or not self.started[self.settled].result.done():
            return False
        self.allowance.give_back(self.started[self.settled].unspent)
        self.settled += 1
        return True


class Investigations:
    """Confirms, shrinks and asks about prevention, for one new signature beside the other.

    An investigation starts when the generation is flown in which its signature occurs first.  Its
    flights wait behind those of the searches, so they take the workers that have nothing else to
    fly.  They follow each other; so they come first once they would take longer than the rest of
    the searches on all workers, or one worker alone would fly them in the end.  Nothing of them
    feeds a search.  What an investigation flies depends on its request and on its number of
    flights, and both are the same for any number of workers and in a resumed run:

    - The signatures of a search get their flights in the order in which they are found, as long as
      the cap lasts.
    - When the search is over, signatures without flights get what others have left over.  The
      others are asked in the order in which they were started, not in that in which they ended.
    - Then other causes of the same kinds are looked for, with what is left over.

    If the pool flies in this process, everything is done after the search.
    """

    def __init__(
        self,
        ledger: Ledger,
        pool: Pool,
        corpus: Corpus,
        shrinking: ShrinkBudget,
        workers: int,
    ) -> None:
        self._ledger, self._pool, self._corpus, self._shrinking = ledger, pool, corpus, shrinking
        self._workers = workers
        self._beside = not pool.in_process
        self._new = NewSignatures(ledger, corpus, shrinking.each)
        self._flights = OnDemandFlights(ledger, pool, priority=self._priority)
        self._further = FurtherCauses(ledger, self._new, shrinking.each)
        self._requests: list[CaseRequest] = []
        self._searches: dict[str, _OfSearch] = {}
        self._started: dict[str, _Investigation] = {}

    @property
    def running(self) -> int:
        """How many investigations have begun and not ended."""
        return sum(not each.result.done() for each in list(self._started.values()))

    @property
    def ended(self) -> int:
        """How many investigations have ended."""
        return len(self._started) - self.running

    @property
    def results(self) -> list[tuple[CaseRequest, CaseResult]]:
        """The requests whose investigation has ended without an error, with their results."""
        ended = [each for each in self._started.values() if each.result.done()]
        return [
            (each.request, each.result.result()) for each in ended if not each.result.exception()
        ]

    @property
    def flown(self) -> int:
        """How many flights they had, also those that were stopped."""
        return self._flights.flown

    def advance(self) -> None:
        """Start the investigations of the generations that are flown, and go on with all."""
        if self._beside:
            self._discover()
            self._flights.advance()

    def requests(self, assertions: Mapping[SearchSignature, UserAssertion]) -> Requests:
        """Return the requests for all that a search found that is over, the most frequent first."""
        self._discover()
        return case_requests(
            self._ledger, self._corpus, self._shrinking.each, self._requests, assertions
        )

    def violations(self, search: str) -> Sequence[LedgerFlight]:
        """Return the flights of a search that violated a property, in slot order."""
        return self._ledger.queries.violating(search)

    def remaining(self, requests: Requests, flight_s: Mapping[str, float]) -> RemainingWork:
        """Return the work that all requests leave; ``flight_s`` is the time of a flight by name."""
        running = [
            (each.request, self._flights.requested(name))
            for name, each in self._started.items()
            if not each.result.done()
        ]
        waiting = [each for each in requests if each.name not in self._started]
        left = {
            search: self._of(search).left_for([each for each in waiting if each.search == search])
            for search in {each.search for each in requests}
        }
        return remaining_work(running, waiting, left, flight_s, self._workers)

    def finish(self, requests: Requests, on_wait: Callable[[], None]) -> dict[str, CaseResult]:
        """Return the results of all requests by name, once the searches are over.

        Raises the first error of an investigation.
        """
        self._share(requests)
        while self.running:
            self._flights.turn()
            on_wait()
            self._share(requests)
        results = {name: each.result.result() for name, each in self._started.items()}
        waiting = [each for each in requests if each.name not in results]
        return results | {each.name: case_without_flights(each) for each in waiting}

    def further(
        self,
        requests: Requests,
        results: Mapping[str, CaseResult],
        on_wait: Callable[[], None],
    ) -> Requests:
        """Return requests for other causes of the kinds that these requests have made cases of."""

        def fly(job: FlightJob, twin: Twin) -> CompletedFlight:
            return wait_for(self._ledger, self._pool, twin.flight, Path(job.flights), on_wait)

        self._further.note(requests, results)
        return self._further.requests(fly)

    def close(self) -> None:
        """End what still runs; its flights are in the ledger for a resumed run."""
        self._flights.close()

    def _discover(self) -> None:
        """Start the investigations of signatures that occur first in generations flown since."""
        for request in self._new.advance():
            self._requests.append(request)
            self._start(request)

    def _share(self, requests: Requests) -> None:
        """Start the requests that wait, as long as flights are left."""
        for search in dict.fromkeys(each.search for each in requests):
            own = [each for each in requests if each.search == search]
            is_first = True
            while is_first or self._of(search).settle_next():
                is_first = False
                for each in own:
                    if each.name not in self._started:
                        self._start(each)

    def _start(self, request: CaseRequest) -> None:
        """Start an investigation if there are flights for it."""
        budget = self._of(request.search).allowance.take(request)
        if not budget:
            return
        request = dataclasses.replace(request, budget=budget)
        # The case's hash parses sources, once; two threads at a time cannot (CPython issue 106905).
        simulator_sha256(request.job.simulator)
        investigate = case_of_finding if request.finding else build_case
        result = self._flights.start(request.name, functools.partial(investigate, request))
        investigation = _Investigation(request=request, result=result)
        self._started[request.name] = investigation
        self._of(request.search).started.append(investigation)

    def _priority(self, name: str, requested: int) -> int:
        """Return the priority of an investigation's next flight."""
        left = self._started[name].request.budget - requested
        is_urgent = left * self._workers >= self._ledger.queries.left()
        return BEFORE_SEARCHES if is_urgent else BEHIND_SEARCHES

    def _of(self, search: str) -> _OfSearch:
        if search not in self._searches:
            cap = self._ledger.queries.wanted(search) if self._shrinking.capped else None
            self._searches[search] = _OfSearch(allowance=Allowance(cap))
        return self._searches[search]
