"""The outcome of an item, decided from facts alone."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.cases.case import NoGateReason, Status
from pytest_garl.plugin.items.outcomes import (
    CaseState,
    Decision,
    Facts,
    FailedItem,
    Need,
    Outcome,
    PassedCase,
    Reason,
    Reflights,
    UnjudgedFlight,
    decide,
    is_about,
    resolve,
    why_unjudged,
)
from tests.support.results import flight_result

DOG, PERSON, OWN = "IV:dog:last-metre:unseen", "IV:person:descent:seen", "own:test_own:12345678"
REPEATS = Reflights(failed=2, flown=2, same=True)
FLAKY = Reflights(failed=2, flown=5)
ONCE = Reflights(failed=1, flown=5)
ALONE = Reflights(failed=1, flown=1)


def found(**facts: Any) -> FailedItem:
    """Return facts about a test that failed on a slot of a search."""
    return FailedItem(**{"signature": DOG} | facts)


def failed(
    status: Status = "open", *, reason: NoGateReason = "", accepted: bool = True, **facts: Any
) -> Any:
    """Return facts about a test that failed on a saved case."""
    elsewhere = facts.pop("of_another_engine", "")
    case = CaseState(
        signature=DOG,
        status=status,
        reason=reason,
        accepted=accepted,
        of_another_engine=elsewhere,
    )
    return found(case=case, **facts)


def passed(status: Status = "open", *, reason: NoGateReason = "", **facts: Any) -> PassedCase:
    """Return facts about a test that passed on a saved case."""
    elsewhere = facts.pop("of_another_engine", "")
    case = CaseState(signature=DOG, status=status, reason=reason, of_another_engine=elsewhere)
    rest: dict[str, Any] = {"violates": False} | facts
    return PassedCase(case=case, **rest)


def unjudged(*, alone: bool, inconclusive: bool = False, **facts: Any) -> UnjudgedFlight:
    """Return facts about a flight that no assertion can judge."""
    rest = {"expects_failure": False} | facts
    return UnjudgedFlight(alone=alone, inconclusive=inconclusive, **rest)


@pytest.mark.parametrize(
    ("result", "why"),
    [
        ({"outcome": "landed"}, ""),
        ({"outcome": "collision", "primary": "collision"}, ""),
        (
            {"outcome": "crashed", "primary": "crash", "story": "It raised."},
            "not judged: It raised.",
        ),
        (
            {"outcome": "gave_up", "primary": "abort"},
            "not judged: the landing system gave up",
        ),
        (
            {"outcome": "inconclusive", "undecided": "3 flights hung"},
            "inconclusive: 3 flights hung",
        ),
    ],
)
def test_no_assertion_judges_a_crash_a_forbidden_abort_and_no_end(
    result: dict[str, Any], why: str
) -> None:
    assert why_unjudged(flight_result(**result)) == why


@pytest.mark.parametrize(
    ("attribute", "name", "about"),
    [
        ("distance_to_landing_m", "distance", True),
        ("elapsed_s", "time", True),
        ("collisions", "collision", True),
        ("collisions", "distance", True),
        ("collisions", "time", False),
        ("outcome", "distance", True),
        ("outcome", None, False),
        ("crash", "crash", True),
    ],
)
def test_assertion_is_about_the_property_whose_attributes_it_reads(
    attribute: str, name: str | None, about: bool
) -> None:
    assert is_about({attribute}, name) is about


@pytest.mark.parametrize(
    ("facts", "outcome", "reason"),
    [
        (found(signature=""), "failed", Reason.TEST_ERROR),
        (found(signature="", inconclusive=True), "failed", Reason.INCONCLUSIVE),
        (found(expected_by="dog.toml"), "xfailed", Reason.EXPECTED),
        (found(repeating=True), "failed", Reason.VIOLATION),
        (found(earlier="lawn-g00-s01"), "xfailed", Reason.DUPLICATE),
        (found(earlier="lawn-g00-s01", duplicates="fail"), "failed", Reason.VIOLATION),
        (found(earlier="", reflights=ONCE), "xfailed", Reason.NOT_REPEATED),
        (found(earlier="", reflights=REPEATS, claimed=True), "failed", Reason.VIOLATION),
        (found(earlier="", reflights=FLAKY, claimed=True), "failed", Reason.VIOLATION),
        (found(earlier="", reflights=ALONE, claimed=True), "failed", Reason.VIOLATION),
        # Another process was faster while this one flew the slot again.
        (
            found(earlier="lawn-g00-s02", reflights=REPEATS, claimed=True),
            "xfailed",
            Reason.DUPLICATE,
        ),
    ],
)
def test_search_item_fails_once_per_repeating_violation(
    facts: Facts, outcome: Outcome, reason: Reason
) -> None:
    assert decide(facts) == Decision(outcome=outcome, reason=reason)


@pytest.mark.parametrize(
    ("facts", "outcome", "reason"),
    [
        (failed(), "xfailed", Reason.KNOWN_CASE),
        (failed(accepted=False), "failed", Reason.NEW_CASE),
        (failed(signature=PERSON), "failed", Reason.FAILS_DIFFERENTLY),
        (failed(reason="edge"), "xfailed", Reason.EDGE),
        (failed(reason="edge", signature=PERSON), "xfailed", Reason.EDGE),
        (failed(reason="edge", signature="V:ValueError", crashed=True), "failed", None),
        (failed("fixed"), "failed", Reason.FAILS_AGAIN),
        (failed("fixed", signature=PERSON), "failed", Reason.FAILS_AGAIN),
        (failed(reason="unpreventable"), "xfailed", Reason.NOT_PREVENTABLE_CASE),
        (failed(reason="sensor-limited"), "xfailed", Reason.NOT_PREVENTABLE_CASE),
        (failed(reason="unpreventable", signature=PERSON), "xfailed", Reason.NOT_PREVENTABLE_CASE),
        (failed(reason="unpreventable", signature="I:nothing:seen"), "failed", None),
        (failed(reason="sensor-limited", signature="II:never-seen"), "failed", None),
        (failed(reason="unpreventable", accepted=False), "xfailed", Reason.NOT_PREVENTABLE_CASE),
        (failed(reason="unpreventable", signature="V:ValueError", crashed=True), "failed", None),
        (failed(reason="unpreventable", signature=OWN, user_property=True), "failed", None),
        (failed(signature=OWN, user_property=True), "failed", Reason.FAILS_DIFFERENTLY),
        (
            failed(signature=OWN, user_property=True, expected_by="own.toml"),
            "xfailed",
            Reason.EXPECTED,
        ),
        # Another known case excuses a property of the user's own, and nothing else.
        (failed(signature=PERSON, expected_by="person.toml"), "failed", None),
        # On another engine a case says nothing but that it fails as saved, and crashes count.
        (failed(of_another_engine="mujoco"), "xfailed", Reason.KNOWN_CASE),
        (failed(accepted=False, of_another_engine="mujoco"), "failed", Reason.NEW_CASE),
        (failed(signature=PERSON, of_another_engine="mujoco"), "xfailed", Reason.OTHER_ENGINE),
        (failed("fixed", of_another_engine="mujoco"), "xfailed", Reason.OTHER_ENGINE),
        (
            failed(signature="V:ValueError", crashed=True, of_another_engine="mujoco"),
            "failed",
            None,
        ),
        (failed(signature=OWN, user_property=True, of_another_engine="mujoco"), "failed", None),
        (failed(inconclusive=True), "failed", Reason.INCONCLUSIVE),
        (failed(signature=""), "failed", Reason.TEST_ERROR),
    ],
)
def test_failing_case_is_expected_only_as_known(
    facts: Facts, outcome: Outcome, reason: Reason | None
) -> None:
    decision = Decision(outcome=outcome, reason=reason or Reason.FAILS_DIFFERENTLY)
    assert decide(facts) == decision


@pytest.mark.parametrize(
    ("facts", "outcome", "reason"),
    [
        (passed(), "passed", Reason.MAYBE_FIXED),
        (passed(unproven=True), "passed", Reason.STALE),
        (passed(violates=True), "passed", Reason.PASSES),
        (passed("fixed"), "passed", Reason.PASSES),
        (passed(reason="unpreventable"), "passed", Reason.PASSES),
        (passed(reason="edge"), "xfailed", Reason.EDGE),
        (passed(strict=True, first=True), "failed", Reason.MAYBE_FIXED),
        (passed(strict=True, first=True, unproven=True), "failed", Reason.STALE),
        (passed(strict=True, first=False), "passed", Reason.MAYBE_FIXED),
        (passed("fixed", strict=True), "passed", Reason.PASSES),
        (passed(reason="edge", strict=True), "xfailed", Reason.EDGE),
        (passed(reason="sensor-limited", strict=True), "passed", Reason.PASSES),
        (passed(of_another_engine="mujoco"), "passed", Reason.OTHER_ENGINE),
        (passed(strict=True, of_another_engine="mujoco"), "passed", Reason.OTHER_ENGINE),
        (passed(reason="edge", of_another_engine="mujoco"), "xfailed", Reason.EDGE),
    ],
)
def test_passing_case_fails_only_if_strict(facts: Facts, outcome: Outcome, reason: Reason) -> None:
    assert decide(facts) == Decision(outcome=outcome, reason=reason)


@pytest.mark.parametrize(
    ("facts", "outcome", "reason"),
    [
        (unjudged(alone=False, first=True), "failed", Reason.CRASH),
        (unjudged(alone=False, first=False), "skipped", Reason.REPORTED_ELSEWHERE),
        (unjudged(alone=False, expects_failure=True), "failed", Reason.CRASH),
        (unjudged(alone=False, inconclusive=True), "skipped", Reason.INCONCLUSIVE),
        (unjudged(alone=True, inconclusive=True, first=True), "failed", Reason.INCONCLUSIVE),
        (unjudged(alone=True, inconclusive=True, first=False), "skipped", None),
    ],
)
def test_unjudged_flight_fails_one_test_of_its_slot(
    facts: Facts, outcome: Outcome, reason: Reason | None
) -> None:
    decision = Decision(outcome=outcome, reason=reason or Reason.REPORTED_ELSEWHERE)
    assert decide(facts) == decision


@pytest.mark.parametrize(
    ("facts", "need"),
    [
        (found(), Need.EARLIER),
        (found(earlier=""), Need.REFLIGHTS),
        (found(earlier="", reflights=REPEATS), Need.CLAIM),
        (passed(strict=True), Need.CLAIM),
        (unjudged(alone=True), Need.CLAIM),
    ],
)
def test_decision_names_the_fact_that_it_needs_next(facts: Facts, need: Need) -> None:
    assert decide(facts) is need


def test_resolve_gathers_facts_until_they_decide() -> None:
    needs = []

    def gather(need: Need, facts: FailedItem) -> FailedItem:
        needs.append(need)
        match need:
            case Need.KNOWN:
                return dataclasses.replace(facts, expected_by="")
            case Need.EARLIER:
                return dataclasses.replace(facts, earlier="")
            case Need.REFLIGHTS:
                return dataclasses.replace(facts, reflights=FLAKY)
            case Need.CLAIM:
                return dataclasses.replace(facts, claimed=True)

    decision, facts = resolve(found(expected_by=None), gather)
    assert decision == Decision(outcome="failed", reason=Reason.VIOLATION)
    assert needs == [Need.KNOWN, Need.EARLIER, Need.REFLIGHTS, Need.CLAIM]
    assert facts.reflights is FLAKY


@pytest.mark.parametrize(
    ("reflights", "confirm"), [(REPEATS, True), (FLAKY, True), (ONCE, False), (ALONE, True)]
)
def test_two_failing_flights_confirm_a_violation(reflights: Reflights, confirm: bool) -> None:
    assert reflights.confirm is confirm
