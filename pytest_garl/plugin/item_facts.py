"""Gather the facts by which ``outcomes`` decides: from saved cases, reflights and the ledger."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TypeVar

from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.item_failure import ItemFailure, first_with_same_signature, refly
from pytest_garl.plugin.outcomes import CaseState, FailedItem, Need, PassedCase, UnjudgedFlight
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.target import Target

F = TypeVar("F", PassedCase, UnjudgedFlight)


def failed_item(
    run: Run, target: Target, result: FlightResult, failure: ItemFailure | None
) -> FailedItem:
    """Return the facts about a failed test that cost no flight; None is an error of the test."""
    if failure is None or result.inconclusive:
        return FailedItem(signature="", inconclusive=result.inconclusive)
    options = run.options
    return FailedItem(
        signature=failure.signature,
        user_property=failure.user_property,
        crashed=result.verdict.violation_type == "V",
        case=case_state(run, target),
        expected_by=run.expected_signatures(target).get(failure.signature, ""),
        repeating=bool(options.repeat),
        duplicates=options.duplicates,
    )


def case_state(run: Run, target: Target) -> CaseState | None:
    """Return the state of the saved case that a target flies, None for a slot of a search."""
    entry = target.entry
    if entry is None or entry.case is None:
        return None
    return CaseState(
        signature=entry.case.violation.signature,
        status=entry.case.status,
        edge=entry.case.edge,
        accepted=run.options.corpus.is_accepted(entry),
    )


def passed_case(run: Run, target: Target, result: FlightResult, unproven: str) -> PassedCase | None:
    """Return the facts about a passed test of a saved case, None for a slot of a search."""
    case = case_state(run, target)
    if case is None:
        return None
    return PassedCase(
        case=case,
        violates=result.verdict.primary is not None,
        unproven=bool(unproven),
        strict=run.options.xfail_strict,
    )


def failure_facts(
    run: Run, target: Target, failure: ItemFailure | None, nodeid: str
) -> Callable[[Need, FailedItem], FailedItem]:
    """Return what adds the facts about a failure that cost flights or entries in the ledger."""

    def gather(need: Need, facts: FailedItem) -> FailedItem:
        assert failure is not None
        match need:
            case Need.EARLIER:
                earlier = first_with_same_signature(run, target, failure, nodeid)
                return dataclasses.replace(facts, earlier=earlier)
            case Need.REFLIGHTS:
                return dataclasses.replace(facts, reflights=refly(run, target, failure))
            case Need.CLAIM:
                faster = run.claims.claim_failure(failure.key(target.search), target.name, nodeid)
                return dataclasses.replace(facts, claimed=True, earlier=faster)

    return gather


def slot_claim(run: Run, target: Target, nodeid: str) -> Callable[[Need, F], F]:
    """Return what adds whether an item is the first that reports its slot."""

    def claim(need: Need, facts: F) -> F:
        assert need is Need.CLAIM
        return dataclasses.replace(facts, first=run.claims.claim_slot(target, nodeid))

    return claim
