"""Which ends of flights are worse than others, and which rates the gate tests."""

from __future__ import annotations

import dataclasses
import itertools

from pytest_garl.gate.comparison_text import summary_lines
from pytest_garl.gate.pairs import FlightSummary
from tests.gate.pairs import ABORTED, DOG, LANDED, NEEDLESS, gate, pairs_of


def test_aborts_in_place_of_collisions_count_as_fixed_and_pass() -> None:
    found = gate((20, DOG, ABORTED), (20, LANDED, LANDED))
    assert found.passed
    assert (found.violations.fixed, found.safe_aborts.broke, found.safe_aborts.p) == (20, 0, 1.0)
    assert len(found.with_result("fixed")) == 20
    lines = list(summary_lines(found))
    assert lines[2:5] == [
        "        landed      violations  blocked     excused     needless",
        "before  20 (50 %)   20          0           0           0",
        "after   20 (50 %)   0           20          0           0",
    ]
    assert lines[5].startswith("violations 20 -> 0 (0 broke, 20 fixed): p 1.000, level 0.05")
    assert lines[6] == (
        "safe aborts 0 -> 20 (0 landings lost, 0 landings won): too few pairs differ to fail"
    )


def test_aborts_in_place_of_landings_fail() -> None:
    found = gate((9, LANDED, ABORTED), (20, DOG, ABORTED), (1, ABORTED, LANDED), (1, DOG, DOG))
    assert not found.passed
    assert (found.safe_aborts.broke, found.safe_aborts.fixed) == (9, 1)
    assert found.safe_aborts.p == 11 / 1024
    assert gate((8, LANDED, ABORTED), (8, ABORTED, LANDED)).passed


def test_collisions_in_place_of_aborts_count_as_violations_alone() -> None:
    found = gate((8, ABORTED, DOG), (1, DOG, DOG))
    assert found.failure_reasons == ("significantly more violations: p 0.008 at level 0.05",)
    assert (found.safe_aborts.broke, found.safe_aborts.fixed) == (0, 0)


def test_a_violating_abort_counts_as_a_violation_alone() -> None:
    forbidden = FlightSummary(outcome="gave_up", signature="abort:blocked", no_landing="blocked")
    found = gate((2, LANDED, forbidden), (1, forbidden, forbidden))
    assert (found.violations.broke, found.safe_aborts.broke) == (2, 0)
    assert (found.safe_aborts.base, found.safe_aborts.head) == (0, 0)
    assert (found.violations.base, found.violations.head) == (1, 3)


def test_needless_aborts_in_place_of_landings_are_violations() -> None:
    found = gate((9, LANDED, NEEDLESS), (6, NEEDLESS, NEEDLESS), (5, DOG, DOG))
    assert (found.violations.broke, found.violations.fixed) == (9, 0)
    assert not found.passed
    assert "after   0 (0 %)     20          0           0           15" in summary_lines(found)


def test_collisions_that_became_needless_aborts_are_fixed() -> None:
    found = gate((20, DOG, NEEDLESS), (6, NEEDLESS, NEEDLESS), (20, LANDED, LANDED))
    assert found.passed
    assert len(found.with_result("fixed")) == 20
    # Its type is not new either, if no other flight has it.
    assert gate((20, DOG, NEEDLESS), (20, LANDED, LANDED)).passed
    assert (found.violations.broke, found.violations.fixed) == (0, 0)
    assert any(
        line.startswith("violations other than no landing 20 -> 0 (0 graver than giving up, 20 m")
        for line in summary_lines(found)
    )


def test_needless_aborts_that_became_collisions_fail_at_an_equal_number_of_violations() -> None:
    found = gate((9, NEEDLESS, DOG), (6, DOG, DOG), (20, LANDED, LANDED))
    assert found.failure_reasons == (
        "significantly more violations other than no landing: p 0.002 at level 0.05",
    )


def test_a_system_that_always_aborts_fails_although_it_collides_with_nothing() -> None:
    found = gate((20, DOG, NEEDLESS), (20, LANDED, NEEDLESS), (6, NEEDLESS, NEEDLESS))
    assert found.failure_reasons[0].startswith("significantly more violations: p ")
    excusing = dataclasses.replace(NEEDLESS, signature="")
    found = gate((20, DOG, excusing), (20, LANDED, excusing), (6, excusing, excusing))
    assert found.failure_reasons[0].startswith("significantly more safe aborts: p ")


def test_pairs_are_ordered_from_landing_to_violation() -> None:
    tolerated = dataclasses.replace(NEEDLESS, signature="")
    ladder = (LANDED, ABORTED, NEEDLESS, DOG)
    for before, after in itertools.pairwise(ladder):
        assert pairs_of((1, before, after))[0].result == "broke"
        assert pairs_of((1, after, before))[0].result == "fixed"
    assert pairs_of((1, ABORTED, tolerated))[0].result == "broke"
    assert pairs_of((1, NEEDLESS, NEEDLESS))[0].result == "same"
