"""After a search: pursue each new signature, and save what was found."""

from __future__ import annotations

import dataclasses
import functools
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.regressions.investigation import (
    EXCEPTION,
    LEAST,
    PILOTS,
    CaseBuilder,
)
from pytest_garl.regressions.new_case import as_found
from pytest_garl.regressions.user_failure import UserAssertion
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario

NOTED = "signatures to pursue"
"""In the ledger: by search, the signatures that no saved case had when the search was done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShrinkBudget:
    """How many flights each new signature has, and whether a search's signatures have a cap.

    The cap is as many flights of the landing system as the search itself; one signature is always
    shrunk.
    """

    each: int
    capped: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class InvestigatedSignature:
    """What became of one new signature: its case and the file, or the reason for none."""

    system: str
    map: str
    finding: CaseResult
    file: Path | None


def case_requests(
    ledger: Ledger,
    corpus: Corpus,
    shrinking: ShrinkBudget,
    own: Mapping[tuple[str, str], UserAssertion] | None = None,
    found_by: Mapping[tuple[str, str], str] | None = None,
) -> tuple[CaseRequest, ...]:
    """Return what is to be found out about signatures that no saved case has.

    Which these are is written down when it is asked first: a run that is resumed after some of its
    cases were saved asks about the same signatures again, and so saves the same cases.
    The most frequent come first; each wants the flights that it may have at most.  ``own`` are
    assertions of tests that failed where the verdict is content, by search and signature;
    ``found_by`` are the node ids of the tests that failed.
    """
    found: list[CaseRequest] = []
    assertions, tests = own or {}, found_by or {}
    groups = _by_search(ledger)
    for search, signature in assertions:
        groups.setdefault(search, {})[signature] = []
    noted: dict[str, list[str]] | None = ledger.fact(NOTED)
    wanted: dict[str, list[str]] = {}
    for search, rows in groups.items():
        text = ledger.job(search)
        assert text is not None
        job = parse_job(text)
        if noted is None:
            expected = corpus.expected_signatures(job.system.name, job.map)
            wanted[search] = [signature for signature in rows if signature not in expected]
        else:
            wanted[search] = noted.get(search, [])
        new = {
            signature: _failures(
                ledger, search, rows[signature], assertions.get((search, signature)), job
            )
            for signature in wanted[search]
            if signature in rows
        }
        cap = len(ledger.queries.flown(search)) if shrinking.capped else None
        map = load_map(job.map, corpus.map_folders)
        found += [
            CaseRequest(
                name=f"{search} {signature}",
                signature=signature,
                violations=new[signature],
                job=job,
                map=map,
                budget=shrinking.each,
                user_assertion=assertions.get((search, signature)),
                test=tests.get((search, signature), ""),
                cap=cap,
            )
            for signature in sorted(new, key=lambda signature: (-len(new[signature]), signature))
            # A test's own assertion may fail only in flights that violate something else as well.
            if new[signature]
        ]
    if noted is None:
        ledger.note_fact(NOTED, wanted)
    return tuple(found)


def shares(
    wanted: Sequence[CaseRequest], findings: Mapping[str, CaseResult] | None = None
) -> tuple[CaseRequest, ...]:
    """Return signatures with the flights that each may have.

    Where a search's cap is too low for all of its signatures, as many are reached as can be, and
    one in any case; the others have none.  ``findings`` have had their share.
    """
    found = []
    for search in dict.fromkeys(each.search for each in wanted):
        before = [each for name, each in (findings or {}).items() if name.startswith(f"{search} ")]
        kinds = [each for each in wanted if each.search == search]
        # The reference pilot's flights take a fraction of the time and are not counted.
        most = [EXCEPTION if kind.exception else kind.budget - PILOTS for kind in kinds]
        given = most
        if kinds[0].cap is not None:
            left = kinds[0].cap - sum(each.flights - each.piloted for each in before)
            given = _divided(most, max(left, 0 if before else most[0]))
        found += [
            dataclasses.replace(kind, budget=_with_pilots(kind, flights))
            for kind, flights in zip(kinds, given, strict=True)
        ]
    return tuple(found)


def _with_pilots(kind: CaseRequest, flights: int) -> int:
    return flights if kind.exception or not flights else flights + PILOTS


def _divided(most: Sequence[int], flights: int) -> list[int]:
    """Return how many of ``flights`` each has that wants at most so many and can do with few.

    What is over is spread evenly, unless some have nothing: then it is for them, together with what
    the others leave.
    """
    given = []
    for wanted in most:
        least = min(wanted, LEAST - PILOTS)
        given.append(least if least <= flights else 0)
        flights -= given[-1]
    if sum(map(bool, given)) == 1:
        # A single one is shrunk as well as can be.
        number = next(number for number, each in enumerate(given) if each)
        given[number] += min(most[number] - given[number], flights)
    elif all(given):
        while flights > 0 and given != [*most]:
            for number, wanted in enumerate(most):
                more = min(1, wanted - given[number], flights)
                given[number] += more
                flights -= more
    return given


def _by_search(ledger: Ledger) -> dict[str, dict[str, list[LedgerFlight]]]:
    found: dict[str, dict[str, list[LedgerFlight]]] = {}
    for row in ledger.queries.violating():
        found.setdefault(row.flight.search, defaultdict(list))[row.signature].append(row)
    return found


def _failures(
    ledger: Ledger,
    search: str,
    violating: Sequence[LedgerFlight],
    user_assertion: UserAssertion | None,
    job: FlightJob,
) -> tuple[tuple[Scenario, CompletedFlight], ...]:
    """Return scenarios with their flights: those that violated, or those that a test refuses."""
    rows = ledger.queries.flown(search) if user_assertion else violating
    flights = [(parse_scenario(row.scenario), done_of(row, job)) for row in rows]
    if user_assertion is None:
        return tuple(flights)
    return tuple(
        (scenario, done)
        for scenario, done in flights
        if user_assertion(done.result, done.record, scenario)
    )


def done_of(row: LedgerFlight, job: FlightJob) -> CompletedFlight:
    """Return a search's flight as what is flown beside it comes back."""
    return CompletedFlight(result=row.result, sha256=row.sha256, record=job.record(row.flight))


def follow_up(
    ledger: Ledger,
    pool: Pool,
    wanted: Sequence[CaseRequest],
    save: Callable[[Case], Path | None],
    tick: Callable[[], None],
) -> tuple[InvestigatedSignature, ...]:
    """Pursue all signatures at once and save their cases; the order is always the same.

    What some leave of a search's cap goes to those that had no share.
    """
    findings: dict[str, CaseResult] = {}
    while reached := _reached(wanted, findings):
        functions: dict[str, Callable[[FlyFunction], CaseResult]] = {
            each.name: functools.partial(_pursue, each) for each in reached
        }
        findings |= OnDemandFlights(ledger, pool, tick).run(functions)
    for each in wanted:
        if each.name not in findings:
            findings[each.name] = as_found(each)
    return tuple(_saved(each, findings[each.name], save) for each in wanted)


def _reached(
    wanted: Sequence[CaseRequest], findings: Mapping[str, CaseResult]
) -> list[CaseRequest]:
    """Return the signatures that are next to be pursued, each with its flights."""
    waiting = [each for each in wanted if each.name not in findings]
    return [each for each in shares(waiting, findings) if each.budget]


def _pursue(request: CaseRequest, fly: FlyFunction) -> CaseResult:
    return CaseBuilder(request, fly).run()


def _saved(
    request: CaseRequest, finding: CaseResult, save: Callable[[Case], Path | None]
) -> InvestigatedSignature:
    job = request.job
    return InvestigatedSignature(
        system=job.system.name,
        map=job.map,
        finding=finding,
        file=save(finding.case) if finding.case else None,
    )
