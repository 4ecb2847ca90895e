"""What had gone wrong before a flight's end: the flight is flown again without NPCs.

A collision with a moving body ends a flight, and hides what would have gone wrong without it.  If
the same scenario without people, dogs and birds violates a property, that is saved as a case.
"""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.on_demand import FlyFunction
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.regressions.investigation import build_case
from pytest_garl.regressions.simplification import without_other_objects
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.verdicts.findings import REPORTED_ONLY

KNOWN_SIGNATURES = "signatures known before the second reading"
"""The ledger's fact: by search, the signatures that have a case, or get one, without a finding."""
TRIED = 3
"""Flights with a finding that are flown again until one of them violates a property."""
NOTHING_ALONE = "flown again without people, dogs and birds, it violates nothing"


def finding_requests(
    ledger: Ledger, corpus: Corpus, budget: int, *, capped: bool
) -> tuple[CaseRequest, ...]:
    """Return a request for each finding of each search, the most frequent first.

    ``budget`` limits the flights for each.  Findings that are only reported have none, nor have
    scenarios that had no NPC in the first place.
    """
    searches: defaultdict[str, list[LedgerFlight]] = defaultdict(list)
    for flight in ledger.queries.flights():
        searches[flight.id.search].append(flight)
    known = _known_signatures(ledger, corpus, searches)
    requests: list[CaseRequest] = []
    for search, flights in searches.items():
        found: defaultdict[str, list[LedgerFlight]] = defaultdict(list)
        for flight in flights:
            for signature in {each.signature for each in flight.result.verdict.findings}:
                found[signature].append(flight)
        job = _job(ledger, search)
        own = [
            _request(search, signature, found[signature], job, budget, known[search])
            for signature in found.keys() - {*REPORTED_ONLY}
        ]
        cap = len(flights) if capped else None
        requests += [
            dataclasses.replace(each, cap=cap)
            for each in sorted(own, key=lambda each: (-len(each.violations), each.signature))
            if each.violations
        ]
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


def _known_signatures(
    ledger: Ledger, corpus: Corpus, searches: dict[str, list[LedgerFlight]]
) -> dict[str, list[str]]:
    """Return, by search, the signatures that need no finding to get a case.

    They are written down when they are asked for first, so that a run that is resumed after some of
    its cases were saved ends like an undisturbed one.
    """
    noted: dict[str, list[str]] | None = ledger.fact(KNOWN_SIGNATURES)
    if noted is not None:
        return {search: noted.get(search, []) for search in searches}
    known = {}
    for search, flights in searches.items():
        job = _job(ledger, search)
        expected = corpus.expected_signatures(job.system.name, job.map)
        own = {flight.signature for flight in flights if flight.signature}
        known[search] = sorted({*expected} | own)
    ledger.note_fact(KNOWN_SIGNATURES, known)
    return known


def _request(
    search: str,
    signature: str,
    flights: Sequence[LedgerFlight],
    job: FlightJob,
    budget: int,
    known: Sequence[str],
) -> CaseRequest:
    map = job.load_map()
    pairs = [
        (parse_scenario(flight.scenario), flight.completed(Path(job.flights))) for flight in flights
    ]
    return CaseRequest(
        name=f"{search} {signature}",
        signature=signature,
        violations=tuple(
            (scenario, completed)
            for scenario, completed in pairs
            if without_other_objects(scenario, map, "") != scenario
        ),
        job=job,
        map=map,
        budget=budget,
        finding=signature,
        known=tuple(known),
    )


def _job(ledger: Ledger, search: str) -> FlightJob:
    text = ledger.job(search)
    assert text is not None
    return parse_job(text)
