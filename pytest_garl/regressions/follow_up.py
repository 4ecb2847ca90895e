"""After a search: make a case of each new signature, and save it."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.on_demand import OnDemandFlights
from pytest_garl.execution.pool import Pool
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.regressions.forecast import divide_flights
from pytest_garl.regressions.investigation import build_case
from pytest_garl.regressions.new_case import case_without_flights
from pytest_garl.regressions.second_reading import case_of_finding, finding_requests
from pytest_garl.regressions.user_failure import UserAssertion
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.scenario import Scenario

NEW_SIGNATURES = "signatures to pursue"
"""The ledger's fact: by search, the signatures that no saved case had when the search ended."""
SearchSignature = tuple[str, str]
"""The key of a search and a signature."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShrinkBudget:
    """The flights for each new signature, and whether a search's signatures have a cap together.

    The cap is as many flights of the landing system as the search itself; one signature is always
    shrunk.
    """

    each: int
    capped: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class InvestigatedSignature:
    """The end of one new signature: its case and the file, or the reason for none.

    ``seen`` is the number of flights that showed a finding before another event.
    """

    system: str
    map: str
    result: CaseResult
    file: Path | None
    seen: int = 0


def case_requests(
    ledger: Ledger,
    corpus: Corpus,
    shrinking: ShrinkBudget,
    assertions: Mapping[SearchSignature, UserAssertion],
    tests: Mapping[SearchSignature, str],
) -> tuple[CaseRequest, ...]:
    """Return a request for each signature that no saved case expects, the most frequent first.

    Behind them stand requests for what had gone wrong before the end of flights.
    ``assertions`` of users' tests failed in flights without built-in violation; ``tests`` are the
    node ids of the tests that failed.
    """
    requests: list[CaseRequest] = []
    found = _signatures(ledger, assertions)
    jobs = {search: _job(ledger, search) for search in found}
    for search, signatures in _new_signatures(ledger, corpus, found, jobs).items():
        job = jobs[search]
        map = job.load_map()
        cap = ledger.queries.count_flights(search) if shrinking.capped else None
        own = []
        for signature in signatures:
            assertion = assertions.get((search, signature))
            violations = _violations(ledger, search, found[search][signature], assertion, job)
            # A test's own assertion may fail only in flights that violate something else as well.
            if violations:
                own.append(
                    CaseRequest(
                        name=f"{search} {signature}",
                        signature=signature,
                        violations=violations,
                        job=job,
                        map=map,
                        budget=shrinking.each,
                        user_assertion=assertion,
                        test=tests.get((search, signature), ""),
                        cap=cap,
                    )
                )
        requests += sorted(own, key=lambda each: (-len(each.violations), each.signature))
    findings = finding_requests(ledger, corpus, shrinking.each, capped=shrinking.capped)
    return (*requests, *findings)


def follow_up(
    ledger: Ledger,
    pool: Pool,
    requests: Sequence[CaseRequest],
    save: Callable[[Case], Path | None],
    on_wait: Callable[[], None],
) -> tuple[InvestigatedSignature, ...]:
    """Make the cases of all requests at once, and save them in the requests' order.

    Signatures that had no share of a search's cap get the flights that others did not need.
    """
    results: dict[str, CaseResult] = {}
    while reached := _next_requests(requests, results):
        procedures = {
            each.name: functools.partial(case_of_finding if each.finding else build_case, each)
            for each in reached
        }
        results |= OnDemandFlights(ledger, pool, on_wait).run(procedures)
    for each in requests:
        if each.name not in results:
            results[each.name] = case_without_flights(each)
    saved: set[SearchSignature] = set()
    investigated = []
    for each in requests:
        result = results[each.name]
        # Two findings may be one violation.
        if not result.finding or (each.search, result.signature) not in saved:
            investigated.append(_save(each, result, save))
            saved.add((each.search, result.signature))
    return tuple(investigated)


def _signatures(
    ledger: Ledger, assertions: Mapping[SearchSignature, UserAssertion]
) -> dict[str, dict[str, list[LedgerFlight]]]:
    """Return, by search and signature, the flights that violated a built-in property."""
    found: dict[str, dict[str, list[LedgerFlight]]] = {}
    for row in ledger.queries.violating():
        found.setdefault(row.id.search, defaultdict(list))[row.signature].append(row)
    for search, signature in assertions:
        found.setdefault(search, {})[signature] = []
    return found


def _new_signatures(
    ledger: Ledger,
    corpus: Corpus,
    found: Mapping[str, Mapping[str, Sequence[LedgerFlight]]],
    jobs: Mapping[str, FlightJob],
) -> dict[str, list[str]]:
    """Return, by search, the signatures that no saved case expects.

    They are written down when they are asked for first: a run that is resumed after some of its
    cases were saved asks for the same signatures again, and so saves the same cases.
    """
    noted: dict[str, list[str]] | None = ledger.fact(NEW_SIGNATURES)
    if noted is not None:
        return {
            search: [signature for signature in noted.get(search, []) if signature in signatures]
            for search, signatures in found.items()
        }
    new = {}
    for search, signatures in found.items():
        job = jobs[search]
        expected = corpus.expected_signatures(job.system.name, job.map)
        new[search] = [signature for signature in signatures if signature not in expected]
    ledger.note_fact(NEW_SIGNATURES, new)
    return new


def _job(ledger: Ledger, search: str) -> FlightJob:
    text = ledger.job(search)
    assert text is not None
    return parse_job(text)


def _violations(
    ledger: Ledger,
    search: str,
    violating: Sequence[LedgerFlight],
    assertion: UserAssertion | None,
    job: FlightJob,
) -> tuple[tuple[Scenario, CompletedFlight], ...]:
    """Return the violating scenarios with their flights: by verdict, or by a test's assertion."""
    rows = violating if assertion is None else ledger.queries.flights(search)
    flights = [(parse_scenario(row.scenario), row.completed(Path(job.flights))) for row in rows]
    return tuple(
        (scenario, flight)
        for scenario, flight in flights
        if assertion is None or assertion(flight, scenario)
    )


def _next_requests(
    requests: Sequence[CaseRequest], results: Mapping[str, CaseResult]
) -> list[CaseRequest]:
    """Return the requests to work on next, each with its flights."""
    waiting = [each for each in requests if each.name not in results]
    return [each for each in divide_flights(waiting, results) if each.budget]


def _save(
    request: CaseRequest, result: CaseResult, save: Callable[[Case], Path | None]
) -> InvestigatedSignature:
    return InvestigatedSignature(
        system=request.job.system.name,
        map=request.job.map,
        result=result,
        file=save(result.case) if result.case else None,
        seen=len(request.violations) if request.finding else 0,
    )
