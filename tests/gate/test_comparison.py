from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.gate.comparison import compare
from pytest_garl.gate.comparison_text import PAIRS_LISTED, report_lines, summary_lines
from pytest_garl.gate.gate_statistics import holm_adjusted, mcnemar_p, new_type_p
from pytest_garl.gate.pairs import FlightSummary, Pair, violation_type_of
from tests.gate.pairs import (
    ABORTED,
    CAT,
    DOG,
    LANDED,
    LOST,
    SAME,
    UNSURE,
    gate,
    pairs_of,
)


@pytest.mark.parametrize(
    ("broke", "fixed", "p"),
    [
        (9, 1, (10 + 1) / 1024),
        (1, 9, 1023 / 1024),
        (5, 0, 1 / 32),
        (8, 3, (165 + 55 + 11 + 1) / 2048),
        (1, 1, 3 / 4),
        (0, 0, 1.0),
        (0, 7, 1.0),
    ],
)
def test_mcnemar_p_is_the_tail_of_the_discordant_pairs(broke: int, fixed: int, p: float) -> None:
    assert mcnemar_p(broke, fixed) == p


@given(st.integers(0, 300), st.integers(0, 300))
def test_mcnemar_p_agrees_with_scipy(broke: int, fixed: int) -> None:
    from scipy.stats import binomtest

    if broke + fixed:
        expected = binomtest(broke, broke + fixed, 0.5, alternative="greater").pvalue
        assert mcnemar_p(broke, fixed) == pytest.approx(expected, rel=1e-9)


def test_holm_doubles_the_smaller_of_two_and_keeps_their_order() -> None:
    assert holm_adjusted([0.01, 0.04]) == (0.02, 0.04)
    assert holm_adjusted([0.03, 0.02]) == (0.04, 0.04)
    assert holm_adjusted([0.8, 0.7]) == (1.0, 1.0)


def test_holm_multiplies_the_smallest_of_three_by_three() -> None:
    assert holm_adjusted([0.01, 1.0, 0.02]) == (0.03, 1.0, 0.04)


def test_nine_broken_against_one_fixed_fail_the_gate() -> None:
    found = gate((1, DOG, LANDED), (9, LANDED, DOG), (10, DOG, DOG), (80, LANDED, LANDED))
    assert not found.passed
    change = found.violations
    assert (change.base, change.head, change.broke, change.fixed) == (11, 19, 9, 1)
    # One test: nothing else differs, and the one type is too frequent to have been missed.
    assert (change.p, change.adjusted, found.tests) == (11 / 1024, 11 / 1024, 1)
    assert found.failure_reasons == ("significantly more violations: p 0.011 at level 0.05",)
    assert gate((1, DOG, LANDED), (9, LANDED, DOG), (10, DOG, DOG), level=0.01).passed


def test_a_rare_type_is_a_test_as_well() -> None:
    assert gate((9, LANDED, DOG), (5, DOG, DOG)).violations.adjusted == 2 / 512
    assert gate((9, LANDED, DOG), (6, DOG, DOG)).violations.adjusted == 1 / 512


def test_four_broken_against_one_fixed_pass() -> None:
    found = gate((1, DOG, LANDED), (4, LANDED, DOG), (5, DOG, DOG))
    assert found.passed
    assert found.violations.p == 6 / 32


def test_six_broken_pairs_fail_beside_a_rare_type_and_five_pass() -> None:
    assert gate((5, LANDED, DOG), (1, DOG, DOG)).passed
    assert not gate((6, LANDED, DOG), (1, DOG, DOG)).passed
    # Without a second test four cannot fail, and five do.
    assert gate((4, LANDED, DOG), (6, DOG, DOG)).violations.adjusted is None
    assert not gate((5, LANDED, DOG), (6, DOG, DOG)).passed


def test_a_better_landing_system_passes() -> None:
    assert gate((30, DOG, LANDED), (1, LANDED, DOG)).passed


def test_equal_landing_systems_pass_without_discordant_pairs() -> None:
    found = gate((7, LANDED, LANDED), (3, DOG, DOG))
    assert found.passed
    assert (found.violations.p, found.safe_aborts.p) == (1.0, 1.0)
    assert {pair.result for pair in found.pairs} == {"same"}


# A type of violation that the base does not have.


def test_a_new_type_fails_at_a_better_rate_if_its_neighbours_fail_alike() -> None:
    counted = ((1, LANDED, LOST), (49, DOG, LANDED))
    found = gate(*counted, beside=(LOST, LOST, DOG))
    assert found.violations.head < found.violations.base
    assert found.failure_reasons == ("new type of violation: II in lawn-0, in 2 of 3 neighbours",)
    # To fail in another way is not to fail alike.
    assert gate(*counted, beside=(LOST, DOG, DOG)).passed
    assert gate(*counted).passed


def test_a_new_type_in_two_pairs_fails_if_few_flights_changed() -> None:
    few = ((2, SAME, LOST), (80, SAME, SAME), (8, LANDED, LANDED))
    found = gate(*few)
    assert found.failure_reasons == ("new type of violation: II in lawn-0 and 1 more",)
    assert gate((1, SAME, LOST), *few[1:]).passed


def test_a_new_type_in_two_pairs_needs_neighbours_if_all_flights_changed() -> None:
    counted = ((2, LANDED, LOST), (98, LANDED, LANDED))
    assert gate(*counted).passed
    assert gate(*counted, beside=(LANDED, LANDED, LANDED)).passed
    found = gate(*counted, beside=(LANDED, LANDED, LOST))
    assert found.failure_reasons == (
        "new type of violation: II in lawn-0 and 1 more, in 2 of 6 neighbours",
    )


def test_a_new_type_in_many_pairs_fails_without_any_neighbour() -> None:
    assert not gate((6, LANDED, LOST), (94, LANDED, LANDED)).passed


def test_an_insignificant_new_type_is_reported_and_passes() -> None:
    found = gate((1, LANDED, LOST), (49, LANDED, LANDED), beside=(LANDED, LANDED, LOST))
    assert found.passed
    assert list(summary_lines(found))[-1] == (
        "new type of violation: II in lawn-0, in 1 of 3 neighbours: p 0.022, level 0.05: may be "
        "chance, look at it"
    )


def test_neighbours_are_flown_for_three_pairs_of_each_new_type() -> None:
    found = compare(pairs_of((4, LANDED, LOST), (3, LANDED, DOG), (1, DOG, DOG)))
    assert [pair.name for pair in found.pairs_to_confirm] == ["lawn-0", "lawn-1", "lawn-2"]
    assert not compare(pairs_of((9, LANDED, LANDED), (1, DOG, CAT))).pairs_to_confirm


def test_an_inconclusive_neighbour_fails_the_gate() -> None:
    found = gate((1, LANDED, LOST), (49, LANDED, LANDED), beside=(LANDED, LANDED, UNSURE))
    assert found.failure_reasons == ("neighbours inconclusive: lawn-0",)


def test_a_new_signature_of_a_known_type_is_reported_and_passes() -> None:
    found = gate((5, DOG, CAT), (3, DOG, DOG), (40, LANDED, LANDED))
    assert found.passed
    assert list(summary_lines(found))[-1] == (
        "new kind of a known type, not gated: IV:cat:descent:seen in lawn-0, lawn-1, lawn-2 and 2 "
        "more"
    )


def test_a_type_of_a_saved_case_is_not_new() -> None:
    counted = ((9, DOG, LANDED), (2, LANDED, LOST))
    assert not gate(*counted, beside=(LOST, LOST, LOST)).passed
    known = gate(*counted, expected_signatures=("II:lost:descent",), beside=(LOST, LOST, LOST))
    assert known.passed
    assert not known.new_signatures
    other = gate(*counted, expected_signatures=("II:never-seen:transit",))
    assert other.passed
    assert [signature for signature, _ in other.new_signatures] == ["II:lost:descent"]


@pytest.mark.parametrize(
    ("signature", "kind"),
    [("IV:dog:descent:seen", "IV"), ("I?:unknown", "I"), ("V:Error@a.b", "V"), ("", "")],
)
def test_a_signature_begins_with_its_type(signature: str, kind: str) -> None:
    assert violation_type_of(signature) == kind


def test_new_type_p_is_largest_for_one_flight_of_the_type() -> None:
    # (1 - v)^n (1 - (1 - v)^n) is largest where both factors are 1/2.
    assert new_type_p(base=100, changed=100, found=1) == pytest.approx(0.25, rel=1e-3)
    assert new_type_p(base=100, changed=0, found=1) == 0.0
    # A type in so many flights is new however many flights there are.
    assert new_type_p(base=5000, changed=5000, found=2500, neighbours_each=3, failing=9) < 1e-9
    values = [new_type_p(base=100, changed=count, found=2) for count in (10, 25, 50, 100)]
    assert values == sorted(values)
    assert new_type_p(base=100, changed=100, found=1, neighbours_each=3, failing=2) < 0.001


# What was not decided.


def test_a_pair_undecided_by_the_head_fails_the_gate() -> None:
    found = gate((1, LANDED, UNSURE), (99, LANDED, LANDED))
    assert found.failure_reasons == ("inconclusive: lawn-0",)
    many = gate((5, LANDED, UNSURE), (9, LANDED, LANDED))
    assert many.failure_reasons == ("inconclusive: lawn-0, lawn-1, lawn-2 and 2 more",)
    assert not gate((99, LANDED, UNSURE), (1, LANDED, LANDED)).passed


def test_a_pair_undecided_by_the_base_is_left_out_and_reported() -> None:
    found = gate((1, UNSURE, DOG), (4, LANDED, LANDED))
    assert found.passed
    assert (len(found.pairs), found.left_out) == (4, 1)
    assert list(summary_lines(found))[2] == "1 left out: inconclusive when the baseline was saved"


def test_a_base_with_more_than_a_twentieth_undecided_fails_the_gate() -> None:
    assert gate((2, UNSURE, DOG), (38, LANDED, LANDED)).passed
    found = gate((2, UNSURE, DOG), (37, LANDED, LANDED))
    assert found.failure_reasons == (
        "2 of 39 flights of the baseline were inconclusive; save it anew",
    )


def test_the_gate_fails_without_comparable_pairs() -> None:
    assert gate().failure_reasons == ("no pair could be compared",)
    assert gate((1, UNSURE, DOG)).failure_reasons == ("no pair could be compared",)


def test_a_pair_with_two_different_violations_counts_as_changed() -> None:
    tree = FlightSummary(outcome="collision", signature="III:tree:descent", paper_violation=True)
    found = gate((1, DOG, tree), (1, tree, DOG))
    assert [pair.result for pair in found.pairs] == ["changed", "changed"]
    assert (found.violations.broke, found.violations.fixed) == (0, 0)
    assert found.passed


def test_the_report_has_the_answer_then_figures_then_a_limited_list_of_pairs() -> None:
    found = gate((PAIRS_LISTED + 5, LANDED, DOG), (1, ABORTED, LANDED), (1, DOG, CAT))
    lines = list(report_lines(found))
    assert lines[0].startswith("gate FAILED: significantly more violations: p 6.0e-08 at level")
    assert lines[1] == f"{PAIRS_LISTED + 7} pairs compared, 0 of them the same flight to the byte"
    assert lines[5].startswith(
        f"violations 1 -> {PAIRS_LISTED + 6} ({PAIRS_LISTED + 5} broke, 0 fixed): p "
    )
    assert lines[6:8] == [
        "safe aborts 1 -> 0 (0 landings lost, 1 landings won): too few pairs differ to fail",
        "distance and time not compared: in no pair did both flights land",
    ]
    assert "broke    lawn-0: landed -> IV:dog:descent:seen" in lines
    assert "broke    and 5 more" in lines
    assert f"fixed    lawn-{PAIRS_LISTED + 5}: gave up (blocked) -> landed" in lines
    assert (
        lines[-1] == f"changed  lawn-{PAIRS_LISTED + 6}: IV:dog:descent:seen -> IV:cat:descent:seen"
    )


def test_identical_flights_are_counted() -> None:
    one, other = (
        FlightSummary(outcome="landed", signature="", sha256=digest)
        for digest in ("ab" * 32, "cd" * 32)
    )
    pairs = [Pair(name="a", base=one, head=one), Pair(name="b", base=one, head=other)]
    assert "1 of them the same flight" in list(summary_lines(compare(pairs)))[1]
