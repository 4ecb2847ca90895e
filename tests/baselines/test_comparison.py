from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.baselines.comparison import SHOWN, Comparison, compare
from pytest_garl.baselines.gate_statistics import holm, looks_new, worse
from pytest_garl.baselines.pairs import Answer, Pair, type_of

LANDED = Answer(outcome="landed", signature="")
ABORTED = Answer(outcome="aborted", signature="")
DOG = Answer(outcome="collision", signature="IV:dog:descent:seen", paper_violation=True)
CAT = Answer(outcome="collision", signature="IV:cat:descent:seen", paper_violation=True)
LOST = Answer(outcome="not_landed", signature="II:lost:descent", paper_violation=True)
UNSURE = Answer(outcome="inconclusive", signature="")
SAME = Answer(outcome="landed", signature="", sha256="ab" * 32)
Counted = tuple[int, Answer, Answer]


def pairs_of(*counted: Counted) -> list[Pair]:
    fates = [(base, head) for count, base, head in counted for _ in range(count)]
    return [
        Pair(name=f"lawn-{index}", base=base, head=head) for index, (base, head) in enumerate(fates)
    ]


def gate(
    *counted: Counted,
    level: float = 0.05,
    known: tuple[str, ...] = (),
    beside: tuple[Answer, ...] = (),
) -> Comparison:
    """Compare pairs; ``beside`` are the neighbours of each whose neighbours are asked for."""
    pairs = pairs_of(*counted)
    asked = compare(pairs, level=level, known=known).to_confirm
    neighbours = {pair.name: beside for pair in asked} if beside else {}
    return compare(pairs, level=level, known=known, neighbours=neighbours)


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
def test_p_is_the_binomial_tail_of_the_discordant_pairs(broke: int, fixed: int, p: float) -> None:
    assert worse(broke, fixed) == p


@settings(deadline=None)
@given(st.integers(0, 300), st.integers(0, 300))
def test_p_agrees_with_scipy(broke: int, fixed: int) -> None:
    from scipy.stats import binomtest

    if broke + fixed:
        expected = binomtest(broke, broke + fixed, 0.5, alternative="greater").pvalue
        assert worse(broke, fixed) == pytest.approx(expected, rel=1e-9)


def test_holm_doubles_the_smaller_of_two_and_keeps_their_order() -> None:
    assert holm([0.01, 0.04]) == (0.02, 0.04)
    assert holm([0.03, 0.02]) == (0.04, 0.04)
    assert holm([0.8, 0.7]) == (1.0, 1.0)


def test_holm_multiplies_the_smallest_of_three_by_three() -> None:
    assert holm([0.01, 1.0, 0.02]) == (0.03, 1.0, 0.04)


def test_nine_broken_against_one_fixed_fail_the_gate() -> None:
    found = gate((1, DOG, LANDED), (9, LANDED, DOG), (10, DOG, DOG), (80, LANDED, LANDED))
    assert not found.passed
    change = found.violations
    assert (change.base, change.head, change.broke, change.fixed) == (11, 19, 9, 1)
    # Two tests, violations and aborts: the one type is too frequent to have been missed.
    assert (change.p, change.adjusted) == (11 / 1024, 22 / 1024)
    assert found.reasons == ("significantly more violations: p 0.021 at level 0.05",)
    assert gate((1, DOG, LANDED), (9, LANDED, DOG), (10, DOG, DOG), level=0.02).passed


def test_a_rare_type_is_a_test_as_well() -> None:
    assert gate((9, LANDED, DOG), (5, DOG, DOG)).violations.adjusted == 3 / 512
    assert gate((9, LANDED, DOG), (6, DOG, DOG)).violations.adjusted == 2 / 512


def test_one_in_ten_that_broke_is_no_proof() -> None:
    found = gate((1, DOG, LANDED), (4, LANDED, DOG), (5, DOG, DOG))
    assert found.passed
    assert found.violations.p == 6 / 32


def test_five_that_broke_alone_do_not_fail_at_the_level_of_all_tests_but_six_do() -> None:
    assert gate((5, LANDED, DOG), (1, DOG, DOG)).passed
    assert not gate((6, LANDED, DOG), (1, DOG, DOG)).passed


def test_a_stack_that_got_better_passes() -> None:
    assert gate((30, DOG, LANDED), (1, LANDED, DOG)).passed


def test_equal_stacks_have_no_discordant_pairs_and_pass() -> None:
    found = gate((7, LANDED, LANDED), (3, DOG, DOG))
    assert found.passed
    assert (found.violations.p, found.aborts.p) == (1.0, 1.0)
    assert {pair.fate for pair in found.pairs} == {"same"}


def test_collisions_that_became_safe_aborts_are_fixed_and_pass() -> None:
    found = gate((20, DOG, ABORTED), (20, LANDED, LANDED))
    assert found.passed
    assert (found.violations.fixed, found.aborts.broke, found.aborts.p) == (20, 0, 1.0)
    assert len(found.of("fixed")) == 20
    lines = list(found.summary())
    assert lines[2].startswith("violations 20 -> 0 (0 broke, 20 fixed): p 1.000, ")
    assert lines[3].startswith("aborts 0 -> 20 (0 landings lost, 0 landings won): p 1.000, ")


def test_landings_that_became_aborts_fail_whatever_collisions_became() -> None:
    found = gate((9, LANDED, ABORTED), (20, DOG, ABORTED), (1, ABORTED, LANDED), (1, DOG, DOG))
    assert not found.passed
    assert (found.aborts.broke, found.aborts.fixed) == (9, 1)
    assert found.aborts.p == 11 / 1024
    assert gate((8, LANDED, ABORTED), (8, ABORTED, LANDED)).passed


def test_aborts_that_became_collisions_are_violations_and_win_no_landing() -> None:
    found = gate((8, ABORTED, DOG), (1, DOG, DOG))
    assert found.reasons == ("significantly more violations: p 0.012 at level 0.05",)
    assert (found.aborts.broke, found.aborts.fixed) == (0, 0)


def test_an_abort_that_is_a_violation_is_tested_as_a_violation_alone() -> None:
    forbidden = Answer(outcome="aborted", signature="abort:descent")
    found = gate((2, LANDED, forbidden), (1, forbidden, forbidden))
    assert (found.violations.broke, found.aborts.broke) == (2, 0)
    assert (found.aborts.base, found.aborts.head) == (1, 3)


# A type of violation that the base does not have.


def test_a_new_type_fails_at_a_better_rate_if_its_neighbours_fail_alike() -> None:
    counted = ((1, LANDED, LOST), (49, DOG, LANDED))
    found = gate(*counted, beside=(LOST, LOST, DOG))
    assert found.violations.head < found.violations.base
    assert found.reasons == ("new type of violation: II in lawn-0, in 2 of 3 neighbours",)
    # To fail in another way is not to fail alike.
    assert gate(*counted, beside=(LOST, DOG, DOG)).passed
    assert gate(*counted).passed


def test_a_new_type_in_two_pairs_fails_if_few_flights_changed() -> None:
    few = ((2, SAME, LOST), (80, SAME, SAME), (8, LANDED, LANDED))
    found = gate(*few)
    assert found.reasons == ("new type of violation: II in lawn-0 and 1 more",)
    assert gate((1, SAME, LOST), *few[1:]).passed


def test_a_new_type_in_two_pairs_needs_neighbours_if_all_flights_changed() -> None:
    counted = ((2, LANDED, LOST), (98, LANDED, LANDED))
    assert gate(*counted).passed
    assert gate(*counted, beside=(LANDED, LANDED, LANDED)).passed
    found = gate(*counted, beside=(LANDED, LANDED, LOST))
    assert found.reasons == (
        "new type of violation: II in lawn-0 and 1 more, in 2 of 6 neighbours",
    )


def test_a_new_type_in_many_pairs_fails_without_any_neighbour() -> None:
    assert not gate((6, LANDED, LOST), (94, LANDED, LANDED)).passed


def test_what_is_new_and_no_proof_is_told() -> None:
    found = gate((1, LANDED, LOST), (49, LANDED, LANDED), beside=(LANDED, LANDED, LOST))
    assert found.passed
    assert list(found.summary())[4] == (
        "new type of violation: II in lawn-0, in 1 of 3 neighbours: p 0.022, for all 3 tests "
        "0.067, level 0.05: may be chance, look at it"
    )


def test_neighbours_are_flown_of_three_pairs_of_each_new_type_alone() -> None:
    found = compare(pairs_of((4, LANDED, LOST), (3, LANDED, DOG), (1, DOG, DOG)))
    assert [pair.name for pair in found.to_confirm] == ["lawn-0", "lawn-1", "lawn-2"]
    assert not compare(pairs_of((9, LANDED, LANDED), (1, DOG, CAT))).to_confirm


def test_a_neighbour_that_decides_nothing_fails_the_gate() -> None:
    found = gate((1, LANDED, LOST), (49, LANDED, LANDED), beside=(LANDED, LANDED, UNSURE))
    assert found.reasons == ("neighbours inconclusive: lawn-0",)


def test_a_new_kind_of_a_known_type_is_told_and_passes() -> None:
    found = gate((5, DOG, CAT), (3, DOG, DOG), (40, LANDED, LANDED))
    assert found.passed
    assert list(found.summary())[4] == (
        "new kind of a known type, not gated: IV:cat:descent:seen in lawn-0, lawn-1, lawn-2 and 2 "
        "more"
    )


def test_a_type_of_a_saved_case_is_not_new() -> None:
    counted = ((9, DOG, LANDED), (2, LANDED, LOST))
    assert not gate(*counted, beside=(LOST, LOST, LOST)).passed
    known = gate(*counted, known=("II:lost:descent",), beside=(LOST, LOST, LOST))
    assert known.passed
    assert not known.new_kinds
    other = gate(*counted, known=("II:never-seen:transit",))
    assert other.passed
    assert [signature for signature, _ in other.new_kinds] == ["II:lost:descent"]


@pytest.mark.parametrize(
    ("signature", "kind"),
    [("IV:dog:descent:seen", "IV"), ("I?:unknown", "I"), ("V:Error@a.b", "V"), ("", "")],
)
def test_a_signature_begins_with_its_type(signature: str, kind: str) -> None:
    assert type_of(signature) == kind


def test_a_type_looks_new_by_chance_most_often_if_the_base_missed_one_flight_of_it() -> None:
    # (1 - v)^n (1 - (1 - v)^n) is largest where both factors are 1/2.
    assert looks_new(base=100, drawn=100, found=1) == pytest.approx(0.25, rel=1e-3)
    assert looks_new(base=100, drawn=0, found=1) == 0.0
    # A type in so many flights is new however many flights there are.
    assert looks_new(base=5000, drawn=5000, found=2500, beside=3, alike=9) < 1e-9
    values = [looks_new(base=100, drawn=drawn, found=2) for drawn in (10, 25, 50, 100)]
    assert values == sorted(values)
    assert looks_new(base=100, drawn=100, found=1, beside=3, alike=2) < 0.001


# What was not decided.


def test_a_pair_that_the_head_does_not_decide_fails_the_gate() -> None:
    found = gate((1, LANDED, UNSURE), (99, LANDED, LANDED))
    assert found.reasons == ("inconclusive: lawn-0",)
    many = gate((5, LANDED, UNSURE), (9, LANDED, LANDED))
    assert many.reasons == ("inconclusive: lawn-0, lawn-1, lawn-2 and 2 more",)
    assert not gate((99, LANDED, UNSURE), (1, LANDED, LANDED)).passed


def test_a_pair_that_the_base_did_not_decide_is_left_out_and_told() -> None:
    found = gate((1, UNSURE, DOG), (4, LANDED, LANDED))
    assert found.passed
    assert (len(found.pairs), found.left_out) == (4, 1)
    assert list(found.summary())[2] == "1 left out: inconclusive when the baseline was saved"


def test_a_base_of_which_more_than_a_twentieth_was_undecided_is_none() -> None:
    assert gate((2, UNSURE, DOG), (38, LANDED, LANDED)).passed
    found = gate((2, UNSURE, DOG), (37, LANDED, LANDED))
    assert found.reasons == ("2 of 39 flights of the baseline were inconclusive; save it anew",)


def test_nothing_compared_is_no_pass() -> None:
    assert gate().reasons == ("no pair could be compared",)
    assert gate((1, UNSURE, DOG)).reasons == ("no pair could be compared",)


def test_another_violation_on_the_same_scenario_changed_and_neither_broke_nor_was_fixed() -> None:
    found = gate((1, DOG, LOST), (1, LOST, DOG))
    assert [pair.fate for pair in found.pairs] == ["changed", "changed"]
    assert (found.violations.broke, found.violations.fixed) == (0, 0)
    assert found.passed


def test_the_sentences_say_the_answer_first_then_figures_and_a_limited_list_of_pairs() -> None:
    found = gate((SHOWN + 5, LANDED, DOG), (1, ABORTED, LANDED), (1, DOG, CAT))
    lines = list(found.sentences())
    assert lines[0].startswith("gate FAILED: significantly more violations: p 8.9e-08 at level")
    assert lines[1] == f"{SHOWN + 7} pairs compared, 0 of them the same flight to the byte"
    assert lines[2].startswith(f"violations 1 -> {SHOWN + 6} ({SHOWN + 5} broke, 0 fixed): p ")
    assert lines[3] == (
        "aborts 1 -> 0 (0 landings lost, 1 landings won): p 1.000, for all 3 tests 1.000, level "
        "0.05"
    )
    assert "broke    lawn-0: landed -> IV:dog:descent:seen" in lines
    assert "broke    and 5 more" in lines
    assert f"fixed    lawn-{SHOWN + 5}: aborted -> landed" in lines
    assert lines[-1] == f"changed  lawn-{SHOWN + 6}: IV:dog:descent:seen -> IV:cat:descent:seen"


def test_the_same_flight_to_the_byte_is_counted() -> None:
    one, other = (
        Answer(outcome="landed", signature="", sha256=digest) for digest in ("ab" * 32, "cd" * 32)
    )
    pairs = [Pair(name="a", base=one, head=one), Pair(name="b", base=one, head=other)]
    assert "1 of them the same flight" in list(compare(pairs).summary())[1]
