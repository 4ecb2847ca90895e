"""After a search: end the investigations, and save a case of each new signature."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.case_requests import SearchSignature
from pytest_garl.regressions.investigations import Investigations


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
) -> tuple[InvestigatedSignature, ...]:
    """End the investigations of all requests, and save the cases in the requests' order.

    ``tests`` are the node ids of the tests that failed; they are known when all tests have run.
    """
    results = investigations.finish(requests, on_wait)
    saved: set[SearchSignature] = set()
    investigated = []
    for each in requests:
        result = results[each.name]
        # Two findings may be one violation.
        if not result.finding or (each.search, result.signature) not in saved:
            test = tests.get((each.search, each.signature), "")
            investigated.append(_save(each, _named_after(result, test), save))
            saved.add((each.search, result.signature))
    return tuple(investigated)


def _named_after(result: CaseResult, test: str) -> CaseResult:
    """Return a result whose case names the test that found the violation, if one failed."""
    if result.case is None or not test:
        return result
    return dataclasses.replace(result, case=dataclasses.replace(result.case, test=test))


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
