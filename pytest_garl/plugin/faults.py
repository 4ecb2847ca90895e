"""What a failing item tells of, whether it was told already, and whether it repeats."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from pytest_garl.execution.on_demand import CompletedFlight
from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.failed_statement import failure_of
from pytest_garl.plugin.keys import LANDING
from pytest_garl.plugin.run import Run, test_of
from pytest_garl.plugin.target import Target
from pytest_garl.plugin.user_assertions import ItemAssertion
from pytest_garl.regressions.user_failure import UserFailure
from pytest_garl.verdicts.statistics import share_interval

REFLIGHTS = 4
"""How often a violation of a system that need not be deterministic is flown once more."""
REPEATED = 2
"""In so many of all flights a violation must show to be one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What a failing item tells of: a built-in verdict, or a property of the user's own.

    ``failure`` is the assertion that failed; None where the flight let no test judge it.
    """

    signature: str
    test: str
    failure: UserFailure | None
    own: bool
    user_assertion: ItemAssertion

    def key(self, search: str) -> str:
        """Return what is the same for all items that tell of the same."""
        if self.failure is None:
            return f"{search} {self.signature}"
        return f"{search} {self.signature} {self.test} {self.failure.assertion}"

    def shows_in(self, run: Run, target: Target, done: CompletedFlight) -> bool:
        """Whether the same assertion of the test fails for the same reason in another flight."""
        verdict = done.result.verdict
        if not self.own and verdict.signature != self.signature:
            return False
        if self.failure is None:
            return True
        if not self.user_assertion.runs_on_any_flight:
            return False
        found = self.user_assertion.failure(done.result, done.record, run.scenario(target))
        if found is None or found.assertion != self.failure.assertion:
            return False
        return found.is_about(verdict.primary) is not self.own

    def shows_again_in(self, run: Run, target: Target, done: CompletedFlight) -> bool:
        """Whether a flight that was flown once more has the same violation."""
        if self.own:
            return self.shows_in(run, target, done)
        return done.signature == self.signature


def fault_of(
    item: pytest.Function, target: Target, result: FlightResult, error: BaseException
) -> Fault | None:
    """Return what a failing item tells of, or None where the test itself is at fault."""
    assertion, test = ItemAssertion(item, target), test_of(item)
    signature = result.signature
    landing = item.stash.get(LANDING, None)
    if landing is not None and landing.unjudged:
        return Fault(
            signature=signature, test=test, failure=None, own=False, user_assertion=assertion
        )
    reads = landing.reads if landing is not None else ()
    failure = failure_of(item.originalname, item.obj, error, reads)
    if failure is None:
        return None
    own = not failure.is_about(result.verdict.primary)
    signature = failure.signature if own else signature
    return Fault(signature=signature, test=test, failure=failure, own=own, user_assertion=assertion)


def told_by(run: Run, target: Target, fault: Fault, nodeid: str) -> str:
    """Return the slot whose item tells of a fault in this run, or nothing.

    One that has not run yet, here or in another of xdist's processes, counts if nothing but a
    test's own doing can keep it from failing; what becomes of it is seen when the session ends.
    """
    there = run.ledger.fact(_told(fault, target))
    if there is not None and there[1] != nodeid:
        return str(there[0])
    for other in run.lower_targets(target):
        waiting = [
            item
            for item in run.items[other.search][other.slot]
            if item.shows
            and (fault.failure is None or item.test == fault.test)
            and not run.has_run(item.nodeid)
        ]
        shows = waiting and fault.shows_in(run, other, _done(run, other))
        if shows and repeats(run, other, fault).holds:
            return other.name
    return ""


def write_down(run: Run, target: Target, fault: Fault, nodeid: str) -> str:
    """Write down that an item tells of a fault; return the slot of one that was faster, if any."""
    there = run.ledger.first_fact(_told(fault, target), [target.name, nodeid])
    return "" if there[1] == nodeid else str(there[0])


def _told(fault: Fault, target: Target) -> str:
    return f"told failure {fault.key(target.search)}"


def _done(run: Run, target: Target) -> CompletedFlight:
    sha256 = run.trajectory_sha256(target)
    return CompletedFlight(result=run.result(target), sha256=sha256, record=run.record(target))


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeats:
    """In how many of a slot's flights a fault shows; ``same`` if two are one flight to the byte."""

    failed: int
    flown: int
    same: bool = False

    @property
    def holds(self) -> bool:
        """Whether the fault shows often enough; one flight is believed where no other is asked."""
        return self.flown == 1 or self.failed >= REPEATED

    @property
    def share(self) -> str:
        """The share in words, with its 95 % interval."""
        low, high = share_interval(self.failed, self.flown)
        return f"{self.failed} of {self.flown} flights fail [{100 * low:.0f}, {100 * high:.0f}] %"


def repeats(run: Run, target: Target, fault: Fault) -> Repeats:
    """Fly a slot once more; where that is another flight, or is said to be, some times more."""
    if target.deterministic:
        (once,) = run.refly(target, 1)
        if once.sha256 == run.trajectory_sha256(target):
            return Repeats(failed=2, flown=2, same=True)
    if fault.own and not fault.user_assertion.runs_on_any_flight:
        # Its test takes what no other flight can be given.
        return Repeats(failed=1, flown=1)
    flown = run.refly(target, REFLIGHTS)
    failed = 1 + sum(fault.shows_again_in(run, target, done) for done in flown)
    return Repeats(failed=failed, flown=1 + REFLIGHTS)
