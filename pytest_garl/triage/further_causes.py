"""Violations of a search with another cause than the cases of their kind have.

A kind is investigated at its first violation, and shrinking leaves one cause.  Others of the same
ending may have another: two mistakes end alike.  They are found as ``known_kinds`` finds them, with
the cases that were known and those that this search makes:

1. A violation in which no cause of these cases acts is investigated.
2. If there is none, the twin of the first violation is flown, without all these causes.  If it
   fails alike, the twin is investigated.

This goes on until neither finds anything.  Then the same search, flown again after its cases were
committed, finds nothing new either.  All is done after the first investigations of all kinds, in
the order of the searches and of their first violations, so that it is the same for any number of
workers.  It costs a flight for each kind, and an investigation for each further cause from the
flights that others have left over.
"""

from __future__ import annotations

import dataclasses
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence

from pytest_garl.cases.case import Case
from pytest_garl.cases.shrunk_cause import cause_of_case
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.triage.known_kinds import Twin, are_alike, request_twin
from pytest_garl.triage.new_signatures import NewSignatures, named, request_of

MOST_CAUSES = 4
"""A search looks for at most this many causes of one ending; the next search looks further."""
Kind = tuple[str, str]
"""The key of a search and an ending."""


class FurtherCauses:
    """Finds what is left to investigate once the investigations so far have ended."""

    def __init__(self, ledger: Ledger, new: NewSignatures, budget: int) -> None:
        self._ledger, self._new, self._budget = ledger, new, budget
        self._names: set[str] = set()
        self._asked: defaultdict[Kind, set[Scenario]] = defaultdict(set)
        self._made: defaultdict[str, list[Case]] = defaultdict(list)
        self._causes: Counter[Kind] = Counter()

    def note(self, requests: Sequence[CaseRequest], results: Mapping[str, CaseResult]) -> None:
        """Take in requests and what came of them."""
        for request in requests:
            self._names.add(request.name)
            case = results[request.name].case
            if request.user_assertion is not None:
                continue
            kind = request.search, request.signature
            self._asked[kind] |= {scenario for scenario, _ in request.violations[:1]}
            self._causes[kind] += 1
            if case is not None:
                self._made[request.search].append(case)

    def requests(self, fly: Callable[[FlightJob, Twin], CompletedFlight]) -> list[CaseRequest]:
        """Return the requests that follow; ``fly`` waits for the flight of a twin."""
        found: list[CaseRequest] = []
        for search, text in self._ledger.searches():
            violations: defaultdict[str, list[LedgerFlight]] = defaultdict(list)
            for flight in self._ledger.queries.violating(search):
                violations[flight.signature].append(flight)
            for ending, flights in violations.items():
                kind = search, ending
                if self._causes[kind] < MOST_CAUSES:
                    found += self._next(kind, flights, parse_job(text), fly)
        return found

    def _next(
        self,
        kind: Kind,
        flights: Sequence[LedgerFlight],
        job: FlightJob,
        fly: Callable[[FlightJob, Twin], CompletedFlight],
    ) -> list[CaseRequest]:
        """Return the next request about a kind, if there is one."""
        search, ending = kind
        known = self._new.known(search)
        made = [each for each in self._made[search] if are_alike(each.ending, ending)]
        same = [cause_of_case(each) for each in made if each.ending == ending]
        if not same and ending not in known:
            # Its first violation has become no case.
            return []
        first: Scenario | None = None
        others = []
        for flight in flights:
            scenario = parse_scenario(flight.scenario)
            excuse = known.without_twin(flight.result, scenario) if ending in known else None
            if (excuse and excuse.known) or any(each.acts_in(scenario) for each in same):
                first = first or scenario
            elif scenario not in self._asked[kind]:
                others.append(flight)
        if others:
            return [self._request(search, ending, others, job)]
        if first is None:
            return []
        twin = request_twin(self._ledger, search, job, first, [*known.alike(ending), *made])
        if twin is None:
            return []
        completed = fly(job, twin)
        kind = search, completed.signature
        if twin.scenario in self._asked[kind] or not known.is_refuted(
            ending, twin, completed.result
        ):
            return []
        if any(each.ending == completed.signature and not cause_of_case(each) for each in made):
            return []
        request = self._request(search, completed.signature, (), job)
        return [dataclasses.replace(request, violations=((twin.scenario, completed),))]

    def _request(
        self, search: str, signature: str, flights: Sequence[LedgerFlight], job: FlightJob
    ) -> CaseRequest:
        number = 1
        while named(search, signature, number) in self._names:
            number += 1
        self._names.add(named(search, signature, number))
        return request_of(search, signature, flights, job, self._budget, number=number)
