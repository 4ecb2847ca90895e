"""Decide the outcome of a landing item, from its flight on: pass, fail, xfail or skip, and why.

Which test of a slot reports which violation is decided here, in this order:

1. Before the test's body: ``why_unjudged`` says whether no assertion can judge the flight.  Then
   one test of the slot fails for it, and the others are skipped (``_unjudged_flight``).
2. While the test reads a property: ``distance_to_landing`` and the three functions below it say
   what it gets, or that it is skipped, because the flight did not decide the property or because
   another test of the slot fails for the same event.
3. After a failed assertion: ``is_about`` says whether it is about the flight's violation, or about
   a property of the user's own.  Then ``_failed_search`` or ``_failed_case``.
4. After a test of a saved case passed: ``_passed_case``.

These are pure functions of facts.  Some facts cost a flight or an entry in the ledger: as long as
such a fact is None, ``decide`` returns a ``Need`` instead, and ``resolve`` asks for the fact.
``item_facts.py`` gathers the facts, ``landing.py`` and ``item_report.py`` apply what is decided,
``report_text.py`` writes the text.  ``session_status.py`` decides the exit status of the session;
it also checks that whatever an item leaves to another one is reported there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Set
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Generic, Literal, TypeVar

if TYPE_CHECKING:
    from pytest_garl.cases.case import NoGateReason, Status
    from pytest_garl.execution.result import FlightResult
    from pytest_garl.verdicts.verdict import Limits

T = TypeVar("T")
Outcome = Literal["passed", "failed", "xfailed", "skipped"]

_MOVING_BODY = "IV:"
"""Begin of the signatures of collisions with moving bodies."""
MINIMUM_FAILURES = 2
"""A violation repeats if at least this many of a slot's flights show it."""
NOT_JUDGED = "not judged"
"""Begins why a test is skipped that its flight does not judge."""


def why_unjudged(result: FlightResult) -> str:
    """Return why no assertion can judge a flight; empty if one can."""
    if result.inconclusive:
        return f"inconclusive: {result.undecided}"
    match result.verdict.primary:
        case "crash":
            return f"{NOT_JUDGED}: {result.verdict.story}"
        case "abort":
            return f"{NOT_JUDGED}: the landing system gave up"
    return ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PropertyRead(Generic[T]):
    """What a test gets that reads a property of its flight: ``value``, unless it is skipped.

    It is skipped if the flight did not decide the property; ``undecided`` says why.  If the value
    shows the violation of another property (``belongs_elsewhere``), the test is skipped if another
    test of the slot fails for that: one event fails one test.
    """

    value: T
    undecided: str | None = None
    belongs_elsewhere: bool = False


def distance_to_landing(result: FlightResult) -> PropertyRead[float]:
    """Return the distance of the landing, or of a touchdown too far off before; inf if it slid."""
    if result.outcome == "slid":
        return PropertyRead(value=math.inf)
    if result.off_marker_m is not None:
        return PropertyRead(value=result.off_marker_m)
    if result.outcome == "landed":
        return PropertyRead(value=result.final_distance_m)
    return PropertyRead(value=math.inf, undecided=_why_undecided(result))


def time_to_landing(result: FlightResult, limits: Limits) -> PropertyRead[float]:
    """Return the time of the landing; inf if the flight needlessly had none."""
    primary = result.verdict.primary
    planned = result.outcome == "held" and result.landed_s is not None and primary != "time"
    if result.outcome != "landed" and not planned:
        undecided = None if primary == "time" else _why_undecided(result)
        return PropertyRead(value=math.inf, undecided=undecided)
    landed_s = result.elapsed_s if result.landed_s is None else result.landed_s
    # What landed elsewhere is not late as well: that is the same event.
    return PropertyRead(value=min(landed_s, limits.time_s) if primary == "distance" else landed_s)


def collisions(result: FlightResult) -> PropertyRead[tuple[str, ...]]:
    """Return what the UAV hit, perhaps after it had touched the ground off the marker.

    Of a UAV that held its place: through what its plans led, if the system reports plans.
    """
    hit, primary = result.collisions, result.verdict.primary
    margin = result.verdict.margin("collision")
    if result.outcome == "held" and margin and not margin.decided:
        return PropertyRead(value=(), undecided=margin.reason)
    return PropertyRead(value=hit, belongs_elsewhere=bool(hit) and primary == "distance")


def completed(result: FlightResult) -> PropertyRead[bool]:
    """Return whether the mission was completed; what prevented it violates another property."""
    verdict = result.verdict
    if verdict.completed:
        return PropertyRead(value=True)
    if verdict.violation or verdict.excuse:
        return PropertyRead(value=False, belongs_elsewhere=verdict.violation)
    # It gave up, and limits(abort="ok") allows that.
    return PropertyRead(value=False, undecided=_why_undecided(result))


def excuse_of(result: FlightResult) -> str:
    """Return why nobody could have landed; empty if somebody could, or if the UAV landed."""
    verdict = result.verdict
    return verdict.excuse and (verdict.excuse_text or verdict.excuse)


def _why_undecided(result: FlightResult) -> str:
    return excuse_of(result) or result.undecided


_READ_BY: dict[str, frozenset[str]] = {
    # A UAV may hit something after it has touched the ground off the marker.
    "distance": frozenset({"distance_to_landing_m", "final_distance_m", "collisions"}),
    "time": frozenset({"time_to_landing_s", "elapsed_s"}),
    "collision": frozenset({"collisions"}),
}
_READ_BY_ALL = frozenset({"outcome", "verdict", "result", "completed", "excused"})
"""The attributes of a landing that belong to each built-in property, and to all of them."""


def is_about(attributes: Set[str], name: str | None) -> bool:
    """Return whether an assertion that reads some attributes is about the property ``name``."""
    if name is None:
        return False
    return bool(attributes & (_READ_BY_ALL | _READ_BY.get(name, frozenset({name}))))


class Reason(Enum):
    """The reason for the outcome of an item."""

    TEST_ERROR = "the test raised something else than a failed assertion"
    INCONCLUSIVE = "the flight was not decided"
    CRASH = "no assertion can judge the flight: the system crashed or gave up"
    REPORTED_ELSEWHERE = "nothing can judge the flight, and another test of the slot says so"
    VIOLATION = "the search found a violation"
    EXPECTED = "a known case excuses it"
    DUPLICATE = "an item of an earlier slot reports the same violation"
    NOT_REPEATED = "the violation did not show again"
    EDGE = "not all neighbours of the case fail, so it gates nothing"
    KNOWN_CASE = "the case is open and known"
    NOT_PREVENTABLE_CASE = "no landing system could prevent it with this camera"
    NEW_CASE = "the case is neither committed nor accepted"
    FAILS_AGAIN = "the case was fixed"
    FAILS_DIFFERENTLY = "the case has another signature"
    PASSES = "the test passes"
    MAYBE_FIXED = "the case is open and passes"
    STALE = "the case is open and passes, which proves nothing"
    OTHER_ENGINE = "the case is another physics engine's, which alone says how it passes and fails"


class Need(Enum):
    """A fact that a decision needs next."""

    KNOWN = "the known case that excuses the failure"
    EARLIER = "the slot of another item that reports the same failure"
    REFLIGHTS = "more flights of the same slot"
    CLAIM = "whether this item is the first to report this"


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The outcome of an item, and why."""

    outcome: Outcome
    reason: Reason


@dataclass(frozen=True, slots=True, kw_only=True)
class Reflights:
    """The flights of a slot that show a failure; ``same`` if two of them are equal to the byte."""

    failed: int
    flown: int
    same: bool = False

    @property
    def confirm(self) -> bool:
        """Whether the failure repeats; a single flight is enough if the test can judge no other."""
        return self.flown == 1 or self.failed >= MINIMUM_FAILURES


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseState:
    """The state of a saved case."""

    signature: str
    status: Status
    reason: NoGateReason = ""
    """Why it gates nothing; empty for a case that gates."""
    accepted: bool = False
    """Whether the case is known: committed, or accepted by a user."""
    of_another_engine: str = ""
    """That another physics engine than its own flies here, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedItem:
    """Facts about an item whose test failed.

    ``signature`` is empty if the test raised something else than a failed assertion.
    """

    signature: str
    user_property: bool = False
    """Whether the assertion is about a property of the user's own."""
    crashed: bool = False
    """Whether the landing system raised, died, hung or broke the simulator."""
    inconclusive: bool = False
    case: CaseState | None = None
    expected_by: str | None = ""
    """File of the known case that excuses it; empty if there is none."""
    unexcused: str = ""
    """Known cases that end alike and do not excuse it, and why not."""
    repeating: bool = False
    """Whether the session repeats one scenario."""
    duplicates: str = "xfail"
    """Value of the ini key ``garl_duplicates``."""
    earlier: str | None = None
    """The slot of another item that reports the same failure; empty if there is none."""
    reflights: Reflights | None = None
    claimed: bool = False
    """Whether the ledger says that this item reports the failure, or which other one does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PassedCase:
    """Facts about a saved case whose test passed."""

    case: CaseState
    violates: bool
    """Whether the flight violates a built-in property, though this test passed."""
    unproven: bool = False
    """Whether passing proves nothing, because more than the landing system has changed."""
    strict: bool = False
    """Value of ``garl_xfail_strict``."""
    first: bool | None = None
    """Whether this is the first test that reports the slot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnjudgedFlight:
    """Facts about a flight that no assertion can judge, before the test's body runs."""

    inconclusive: bool
    alone: bool
    """Whether the slot is a saved case or is repeated, and does not belong to a search."""
    expects_failure: bool
    """Whether the test is marked xfail."""
    first: bool | None = None
    """Whether this is the first test that reports the slot."""


Facts = FailedItem | PassedCase | UnjudgedFlight
F = TypeVar("F", FailedItem, PassedCase, UnjudgedFlight)


def resolve(facts: F, gather: Callable[[Need, F], F]) -> tuple[Decision, F]:
    """Return the decision and the facts behind it; ``gather`` adds a fact that is needed."""
    decided = decide(facts)
    while isinstance(decided, Need):
        facts = gather(decided, facts)
        decided = decide(facts)
    return decided, facts


def decide(facts: Facts) -> Decision | Need:
    """Return what becomes of an item, or the fact that must be known first."""
    match facts:
        case UnjudgedFlight():
            return _unjudged_flight(facts)
        case PassedCase():
            return _passed_case(facts)
        case FailedItem(inconclusive=True):
            return _fail(Reason.INCONCLUSIVE)
        case FailedItem(signature=""):
            return _fail(Reason.TEST_ERROR)
        case FailedItem(case=CaseState() as case):
            return _failed_case(facts, case)
    return _failed_search(facts)


def _unjudged_flight(facts: UnjudgedFlight) -> Decision | Need:
    """Let one test of the slot fail and the others skip.

    Undecided flights are counted for a whole search.  A test that is expected
    to fail reports nothing, so another one must.
    """
    if facts.inconclusive and not facts.alone:
        return Decision(outcome="skipped", reason=Reason.INCONCLUSIVE)
    if not facts.expects_failure:
        if facts.first is None:
            return Need.CLAIM
        if not facts.first:
            return Decision(outcome="skipped", reason=Reason.REPORTED_ELSEWHERE)
    return _fail(Reason.INCONCLUSIVE if facts.inconclusive else Reason.CRASH)


def _failed_search(facts: FailedItem) -> Decision | Need:
    """Report each violation of a search once, if it repeats and no known case has it."""
    if facts.expected_by is None:
        return Need.KNOWN
    if facts.expected_by:
        return _xfail(Reason.EXPECTED)
    if facts.repeating:
        return _fail(Reason.VIOLATION)
    if facts.earlier is None:
        return Need.EARLIER
    if not facts.earlier:
        if facts.reflights is None:
            return Need.REFLIGHTS
        if not facts.reflights.confirm:
            return _xfail(Reason.NOT_REPEATED)
        if not facts.claimed:
            return Need.CLAIM
    if facts.earlier and facts.duplicates == "xfail":
        return _xfail(Reason.DUPLICATE)
    return _fail(Reason.VIOLATION)


def _failed_case(facts: FailedItem, case: CaseState) -> Decision:
    """Let a known open case fail as it did before, and a fixed one not at all.

    A case that gates nothing need not be known.
    """
    same = facts.signature == case.signature
    if case.reason == "edge" and (same or not (facts.user_property or facts.crashed)):
        return _xfail(Reason.EDGE)
    open_as_saved = case.status == "open" and same
    # Such a collision may show in another phase; that excuses nothing else.
    not_preventable = bool(case.reason) and facts.signature.startswith(_MOVING_BODY)
    if (open_as_saved or not_preventable) and (case.accepted or case.reason):
        return _xfail(Reason.NOT_PREVENTABLE_CASE if case.reason else Reason.KNOWN_CASE)
    if facts.user_property and not same and facts.expected_by:
        return _xfail(Reason.EXPECTED)
    if open_as_saved or not_preventable:
        return _fail(Reason.NEW_CASE)
    if case.of_another_engine and not (facts.user_property or facts.crashed):
        return _xfail(Reason.OTHER_ENGINE)
    return _fail(Reason.FAILS_AGAIN if case.status == "fixed" else Reason.FAILS_DIFFERENTLY)


def _passed_case(facts: PassedCase) -> Decision | Need:
    """Note that an open case passes; with ``garl_xfail_strict`` fail its first test."""
    case = facts.case
    if case.reason == "edge":
        return _xfail(Reason.EDGE)
    if case.status != "open" or case.reason or facts.violates:
        return Decision(outcome="passed", reason=Reason.PASSES)
    if case.of_another_engine:
        return Decision(outcome="passed", reason=Reason.OTHER_ENGINE)
    reason = Reason.STALE if facts.unproven else Reason.MAYBE_FIXED
    if facts.strict:
        if facts.first is None:
            return Need.CLAIM
        if facts.first:
            return _fail(reason)
    return Decision(outcome="passed", reason=reason)


def _fail(reason: Reason) -> Decision:
    return Decision(outcome="failed", reason=reason)


def _xfail(reason: Reason) -> Decision:
    return Decision(outcome="xfailed", reason=reason)
