"""Gather the facts by which ``outcomes`` decides: the failure, reflights, cases, the ledger."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import pytest

from pytest_garl.cases.user_failure import UserFailure
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.items.failed_statement import failure_of
from pytest_garl.plugin.items.keys import LANDING
from pytest_garl.plugin.items.outcomes import (
    CaseState,
    Decision,
    FailedItem,
    Need,
    PassedCase,
    Reflights,
    UnjudgedFlight,
    decide,
    is_about,
    why_unjudged,
)
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.items.user_assertions import ItemAssertion
from pytest_garl.plugin.session.run import REFLIGHTS, Run, test_of

F = TypeVar("F", PassedCase, UnjudgedFlight)


def failed_item(
    run: Run, target: Target, result: FlightResult, failure: ItemFailure | None
) -> FailedItem:
    """Return the facts about a failed test that cost no flight; None is an error of the test."""
    if failure is None or result.inconclusive:
        return FailedItem(signature="", inconclusive=result.inconclusive)
    options = run.options
    by_signature = target.entry is not None or failure.user_property
    expected = run.expected_signatures(target).get(failure.signature, "") if by_signature else None
    return FailedItem(
        signature=failure.signature,
        user_property=failure.user_property,
        crashed=result.verdict.violation_type == "V",
        case=case_state(run, target),
        expected_by=expected,
        repeating=bool(options.repeat),
        duplicates=options.duplicates,
    )


def case_state(run: Run, target: Target) -> CaseState | None:
    """Return the state of the saved case that a target flies, None for a slot of a search."""
    entry = target.entry
    if entry is None or entry.case is None:
        return None
    return CaseState(
        signature=entry.case.ending,
        status=entry.case.status,
        reason=entry.case.reason,
        accepted=run.corpus.is_accepted(entry),
        of_another_engine=entry.case.of_another_engine,
    )


def is_known_case(run: Run, target: Target, result: FlightResult) -> bool:
    """Return whether a flight is that of a saved case, and a test that fails for it is excused."""
    case = case_state(run, target)
    if case is None or result.inconclusive:
        return False
    crashed = result.verdict.violation_type == "V"
    decided = decide(FailedItem(signature=result.signature, crashed=crashed, case=case))
    return isinstance(decided, Decision) and decided.outcome == "xfailed"


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
            case Need.KNOWN:
                return _with_excuse(run, target, failure, facts)
            case Need.EARLIER:
                earlier = first_with_same_signature(run, target, failure, nodeid)
                return dataclasses.replace(facts, earlier=earlier)
            case Need.REFLIGHTS:
                return dataclasses.replace(facts, reflights=refly(run, target, failure))
            case Need.CLAIM:
                faster = run.claims.claim_failure(failure.key(target.search), target.name, nodeid)
                return dataclasses.replace(facts, claimed=True, earlier=faster)

    return gather


def _with_excuse(run: Run, target: Target, failure: ItemFailure, facts: FailedItem) -> FailedItem:
    """Add the known case that excuses a violation of a search, or why none does."""
    excuse = run.known.excuse(target, failure.signature)
    unexcused = ""
    if excuse.reason:
        files = run.known.files(target, failure.signature)
        unexcused = f"A known case ends alike and does not excuse it ({files}): {excuse.reason}."
    return dataclasses.replace(
        facts,
        expected_by=excuse.known.name if excuse.known else "",
        unexcused=unexcused,
    )


def slot_claim(run: Run, target: Target, nodeid: str) -> Callable[[Need, F], F]:
    """Return what adds whether an item is the first that reports its slot."""

    def claim(need: Need, facts: F) -> F:
        assert need is Need.CLAIM
        return dataclasses.replace(facts, first=run.claims.claim_slot(target, nodeid))

    return claim


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemFailure:
    """A built-in violation that an item shows, or a failed assertion about the user's own property.

    ``failed_assertion`` is None if the flight let no assertion judge it.
    """

    signature: str
    test: str
    failed_assertion: UserFailure | None
    user_property: bool
    assertion: ItemAssertion

    @property
    def savable(self) -> bool:
        """Whether a case of it can be judged: its test can run on other flights."""
        return not self.user_property or self.assertion.runs_on_any_flight

    def key(self, search: str) -> str:
        """Return a key that is the same for all items of a search that show the same failure."""
        if self.failed_assertion is None:
            return f"{search} {self.signature}"
        return f"{search} {self.signature} {self.test} {self.failed_assertion.assertion}"

    def shows_in(self, run: Run, target: Target, flight: CompletedFlight) -> bool:
        """Return whether the same assertion fails for the same reason in another flight."""
        if not self.user_property and flight.signature != self.signature:
            return False
        if self.failed_assertion is None:
            return True
        if not self.assertion.runs_on_any_flight:
            return False
        found = self.assertion.failure(
            flight, run.scenario(target), lambda: another_test_fails(run, target, flight)
        )
        if found is None or found.assertion != self.failed_assertion.assertion:
            return False
        return is_about(found.attributes, flight.result.verdict.primary) is not self.user_property

    def repeats_in(self, run: Run, target: Target, flight: CompletedFlight) -> bool:
        """Return whether a reflight of the slot has the same violation."""
        if self.user_property:
            return self.shows_in(run, target, flight)
        return flight.signature == self.signature


def failure_of_item(
    item: pytest.Function, target: Target, result: FlightResult, error: BaseException
) -> ItemFailure | None:
    """Return what an item's failure is about, or None if the test itself has an error."""
    assertion, test = ItemAssertion(item, target), test_of(item)
    failed: UserFailure | None = None
    user_property = False
    if not why_unjudged(result):
        failed = failure_of(item.originalname, item.obj, error, item.stash[LANDING].reads)
        if failed is None:
            return None
        user_property = not is_about(failed.attributes, result.verdict.primary)
    return ItemFailure(
        signature=failed.signature if failed and user_property else result.signature,
        test=test,
        failed_assertion=failed,
        user_property=user_property,
        assertion=assertion,
    )


def first_with_same_signature(run: Run, target: Target, failure: ItemFailure, nodeid: str) -> str:
    """Return the slot of another item that reports the same failure, or nothing.

    An item of a lower slot that has not run yet, in this process or another, counts if it can only
    fail; ``session_status`` checks in the end that it did.
    """
    slot = run.claims.reporting_slot(failure.key(target.search), nodeid)
    if slot:
        return slot
    for other in run.searches.lower(target):
        waiting = [
            item
            for item in run.items[other.flight]
            if item.shows
            and (failure.failed_assertion is None or item.test == failure.test)
            and not run.ledger.facts.has_run(item.nodeid)
        ]
        shows = waiting and failure.shows_in(run, other, run.flight(other))
        if shows and not failure.user_property and run.known.excuse(other, failure.signature).known:
            continue
        if shows and refly(run, other, failure).confirm:
            return other.name
    return ""


def another_test_fails(run: Run, target: Target, flight: CompletedFlight) -> bool:
    """Return whether a selected test of a slot fails for the violation, ``completed`` aside.

    It need not have run yet: its assertions are tried on the flight.  A test with other fixtures
    than landing and scenario cannot be tried.
    """
    for selected in run.items.get(target.flight, ()):
        if not selected.shows or not isinstance(selected.item, pytest.Function):
            continue
        assertion = ItemAssertion(selected.item, target)
        if not assertion.runs_on_any_flight:
            continue
        # Whether the mission was completed decides nothing here: each such test would wait for
        # the others.
        failure = assertion.failure(flight, run.scenario(target), lambda: True)
        if failure is not None and is_about(failure.attributes, flight.result.verdict.primary):
            return True
    return False


def refly(run: Run, target: Target, failure: ItemFailure) -> Reflights:
    """Fly a slot once more; fly it some times more if the system need not be, or is not, the same.

    A system that is deterministic and flies the same bytes again needs no further flight.
    """
    if target.deterministic:
        (once,) = run.refly(target, 1)
        if once.sha256 == run.flight(target).sha256:
            return Reflights(failed=2, flown=2, same=True)
    if failure.user_property and not failure.assertion.runs_on_any_flight:
        # The test takes what no other flight can give it.
        return Reflights(failed=1, flown=1)
    flown = run.refly(target, REFLIGHTS)
    failed = 1 + sum(failure.repeats_in(run, target, flight) for flight in flown)
    return Reflights(failed=failed, flown=1 + REFLIGHTS)


def divergence_s(run: Run, target: Target) -> float | None:
    """Return when a slot's flight and its first reflight part; None if one was not recorded."""
    from pytest_garl.flight.flight_file import divergence_time_s, load

    files = [run.flight(target).record, target.reflight(0).record(run.options.flights)]
    if not all(file.exists() for file in files):
        return None
    first, second = (load(file) for file in files)
    return divergence_time_s(first, second)
