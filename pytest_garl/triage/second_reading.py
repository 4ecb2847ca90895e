"""What had gone wrong before a flight's end: the flight is flown again without NPCs.

A collision with a moving body ends a flight, and hides what would have gone wrong without it.  If
the same scenario without people, dogs and birds violates a property, that is saved as a case.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence

from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.shrinking.investigation import build_case
from pytest_garl.shrinking.simplification import without_other_objects
from pytest_garl.triage.new_signatures import request_of
from pytest_garl.verdicts.findings import REPORTED_ONLY

TRIED = 3
"""Flights with a finding that are flown again until one of them violates a property."""
NOTHING_ALONE = "flown again without people, dogs and birds, it violates nothing"


def finding_requests(
    ledger: Ledger, expected: Mapping[str, Collection[str]], budget: int
) -> tuple[CaseRequest, ...]:
    """Return a request for each finding of each search, the most frequent first.

    ``expected`` are, by search, the signatures that saved cases expect.  ``budget`` limits the
    flights for each.  Findings that are only reported have none, nor have scenarios that had no NPC
    in the first place.
    """
    requests: list[CaseRequest] = []
    for search, text in ledger.searches():
        flights = ledger.queries.flights(search)
        found: defaultdict[str, list[LedgerFlight]] = defaultdict(list)
        for flight in flights:
            for signature in {each.signature for each in flight.result.verdict.findings}:
                found[signature].append(flight)
        known = {*expected[search], *(each.signature for each in flights if each.signature)}
        job = parse_job(text)
        own = [
            _request(search, signature, found[signature], job, budget, sorted(known))
            for signature in found.keys() - {*REPORTED_ONLY}
        ]
        requests += sorted(
            (each for each in own if each.violations),
            key=lambda each: (-len(each.violations), each.signature),
        )
    return tuple(requests)


def case_of_finding(request: CaseRequest, fly: FlyFunction) -> CaseResult:
    """Fly scenarios with a finding again without NPCs; return the case of the first that violates.

    The case is an ordinary one: confirmed, shrunk, with its own signature.
    """
    flown = 0
    for scenario in request.scenarios[: min(TRIED, request.budget)]:
        alone = without_other_objects(scenario, request.map, "")
        flight = fly(request.job, alone)
        flown += 1
        if not flight.result.verdict.violation:
            continue
        if flight.signature in request.known:
            reason = f"without people, dogs and birds it fails as {flight.signature}, which is "
            return _no_case(request, flown, f"{reason}among the violations or the known cases")
        ordinary = dataclasses.replace(
            request,
            signature=flight.signature,
            violations=((alone, flight),),
            budget=request.budget - flown,
            finding="",
        )
        made = build_case(ordinary, fly)
        return dataclasses.replace(made, flights=made.flights + flown, finding=request.signature)
    return _no_case(request, flown, NOTHING_ALONE)


def _no_case(request: CaseRequest, flown: int, reason: str) -> CaseResult:
    return CaseResult(
        signature=request.signature,
        case=None,
        flights=flown,
        reason=reason,
        finding=request.signature,
    )


def _request(
    search: str,
    signature: str,
    flights: Sequence[LedgerFlight],
    job: FlightJob,
    budget: int,
    known: Sequence[str],
) -> CaseRequest:
    request = request_of(search, signature, flights, job, budget)
    violations = tuple(
        (scenario, completed)
        for scenario, completed in request.violations
        if without_other_objects(scenario, request.map, "") != scenario
    )
    return dataclasses.replace(
        request, violations=violations, finding=signature, known=tuple(known)
    )
