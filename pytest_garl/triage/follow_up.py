"""After a search: end the investigations, and save a case of each new signature."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.cases.case import Case, Worst
from pytest_garl.cases.shrunk_cause import cause_of_case
from pytest_garl.cases.worst import worst_in, worst_of
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.shrinking.case_request import CaseRequest, CaseResult
from pytest_garl.triage.candidates import SearchSignature
from pytest_garl.triage.investigation_queue import Investigations


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


def follow_up(
    investigations: Investigations,
    requests: Sequence[CaseRequest],
    tests: Mapping[SearchSignature, str],
    save: Callable[[Case], Path | None],
    on_wait: Callable[[], None],
) -> Iterator[InvestigatedSignature]:
    """End the investigations of all requests; save the cases, and yield them, in their order.

    ``tests`` are the node ids of the tests that failed; they are known when all tests have run.
    Behind the requests stand those for other causes of their kinds.  After Ctrl-C the cases of the
    investigations that have ended are saved, and KeyboardInterrupt is raised behind them.
    """
    interrupt = None
    try:
        results = investigations.finish(requests, on_wait)
        further = requests
        while further := investigations.further(further, results, on_wait):
            results |= investigations.finish(further, on_wait)
            requests = (*requests, *further)
    except KeyboardInterrupt as error:
        interrupt = error
        requests = [request for request, _ in investigations.results]
        results = {request.name: result for request, result in investigations.results}
    saved: set[SearchSignature] = set()
    for each in requests:
        result = results[each.name]
        # Two findings may be one violation.
        if not result.finding or (each.search, result.signature) not in saved:
            test = tests.get((each.search, each.signature), "")
            bounded = _with_worst(result, investigations.violations(each.search))
            yield _save(each, _named_after(bounded, test), save)
            saved.add((each.search, result.signature))
    if interrupt is not None:
        raise interrupt


def _named_after(result: CaseResult, test: str) -> CaseResult:
    """Return a result whose case names the test that found the violation, if one failed."""
    if result.case is None or not test:
        return result
    return dataclasses.replace(result, case=dataclasses.replace(result.case, test=test))


def _with_worst(result: CaseResult, violations: Sequence[LedgerFlight]) -> CaseResult:
    """Return a result whose case holds the worst violation of its kind in the search.

    These are the violations that the case would excuse but for this figure, and its own flight.
    """
    case = result.case
    if case is None or case.violation.type == "own":
        return result
    cause = cause_of_case(case)
    found = [
        worst_of(each.result)
        for each in violations
        if each.signature == case.ending and cause.acts_in(parse_scenario(each.scenario))
    ]
    own = Worst(margin=case.violation.margin, grade=case.severity.grade)
    bounded = dataclasses.replace(case, worst=worst_in([own, *found]))
    return dataclasses.replace(result, case=bounded)


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
