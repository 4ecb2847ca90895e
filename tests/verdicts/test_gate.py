from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.verdicts.gate import SHOWN, Answer, Comparison, Pair, compare, holm, worse

LANDED = Answer(outcome="landed", signature="")
ABORTED = Answer(outcome="aborted", signature="")
DOG = Answer(outcome="collision", signature="IV:dog:descent:seen", paper_violation=True)
LOST = Answer(outcome="landed", signature="II:lost:descent", paper_violation=True)
UNSURE = Answer(outcome="inconclusive", signature="")


def gate(*counted: tuple[int, Answer, Answer], level: float = 0.05) -> Comparison:
    fates = [(base, head) for count, base, head in counted for _ in range(count)]
    pairs = [
        Pair(name=f"lawn-{index}", base=base, head=head) for index, (base, head) in enumerate(fates)
    ]
    return compare(pairs, level=level)


@pytest.mark.parametrize(
    ("broke", "mended", "p"),
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
def test_p_is_the_binomial_tail_of_the_discordant_pairs(broke: int, mended: int, p: float) -> None:
    assert worse(broke, mended) == p


@settings(deadline=None)
@given(st.integers(0, 300), st.integers(0, 300))
def test_p_agrees_with_scipy(broke: int, mended: int) -> None:
    from scipy.stats import binomtest

    if broke + mended:
        expected = binomtest(broke, broke + mended, 0.5, alternative="greater").pvalue
        assert worse(broke, mended) == pytest.approx(expected, rel=1e-9)


def test_holm_doubles_the_smaller_of_two_and_keeps_their_order() -> None:
    assert holm([0.01, 0.04]) == (0.02, 0.04)
    assert holm([0.03, 0.02]) == (0.04, 0.04)
    assert holm([0.8, 0.7]) == (1.0, 1.0)


def test_nine_broken_against_one_mended_fail_the_gate() -> None:
    found = gate((1, DOG, LANDED), (9, LANDED, DOG), (10, DOG, DOG), (80, LANDED, LANDED))
    assert not found.passed
    change = found.violations
    assert (change.base, change.head, change.broke, change.mended) == (11, 19, 9, 1)
    assert (change.p, change.adjusted) == (11 / 1024, 22 / 1024)
    assert found.reasons == ("significantly more violations: p 0.021 at level 0.05",)
    assert gate((1, DOG, LANDED), (9, LANDED, DOG), level=0.02).passed


def test_one_in_ten_that_broke_is_no_proof() -> None:
    found = gate((1, DOG, LANDED), (4, LANDED, DOG), (5, DOG, DOG))
    assert found.passed
    assert found.violations.p == 6 / 32


def test_five_that_broke_alone_do_not_fail_at_the_level_of_two_tests_but_six_do() -> None:
    assert gate((5, LANDED, DOG), (1, DOG, DOG)).passed
    assert not gate((6, LANDED, DOG), (1, DOG, DOG)).passed


def test_a_stack_that_got_better_passes() -> None:
    assert gate((30, DOG, LANDED), (1, LANDED, DOG)).passed


def test_equal_stacks_have_no_discordant_pairs_and_pass() -> None:
    found = gate((7, LANDED, LANDED), (3, DOG, DOG))
    assert found.passed
    assert (found.violations.p, found.aborts.p) == (1.0, 1.0)
    assert {pair.fate for pair in found.pairs} == {"same"}


def test_to_abort_instead_of_colliding_is_a_trade_that_shows() -> None:
    found = gate((8, DOG, ABORTED), (20, LANDED, LANDED))
    assert not found.passed
    assert found.reasons == ("significantly more aborts: p 0.008 at level 0.05",)
    assert (found.violations.mended, found.aborts.broke) == (8, 8)
    assert len(found.of("mended")) == 8


def test_an_abort_that_is_a_violation_counts_as_both() -> None:
    forbidden = Answer(outcome="aborted", signature="abort:descent")
    found = gate((2, LANDED, forbidden))
    assert (found.violations.broke, found.aborts.broke) == (2, 2)


def test_a_new_signature_fails_even_at_a_better_rate() -> None:
    found = gate((1, LANDED, LOST), (9, DOG, LANDED))
    assert found.violations.head < found.violations.base
    assert found.new_signatures == ("II:lost:descent",)
    assert not found.passed
    assert found.reasons == ("new signature: II:lost:descent",)


def test_a_known_signature_is_not_new() -> None:
    pairs = [Pair(name="lawn-0", base=LANDED, head=LOST)]
    assert not compare(pairs).passed
    assert compare(pairs, known={"II:lost:descent"}).passed


def test_another_violation_on_the_same_scenario_changed_and_neither_broke_nor_was_mended() -> None:
    found = gate((1, DOG, LOST), (1, LOST, DOG))
    assert [pair.fate for pair in found.pairs] == ["changed", "changed"]
    assert (found.violations.broke, found.violations.mended) == (0, 0)
    assert found.passed


def test_what_is_inconclusive_is_left_out_and_nothing_compared_is_no_pass() -> None:
    found = gate((3, UNSURE, DOG), (3, LANDED, UNSURE), (4, LANDED, LANDED))
    assert (len(found.pairs), found.inconclusive) == (4, 6)
    assert found.passed
    nothing = gate((3, UNSURE, DOG))
    assert not nothing.passed
    assert nothing.reasons == ("no pair could be compared",)


def test_the_sentences_say_the_answer_first_then_figures_and_a_limited_list_of_pairs() -> None:
    found = gate((SHOWN + 5, LANDED, DOG), (1, ABORTED, LANDED), (1, DOG, LOST))
    lines = list(found.sentences())
    assert lines[0].startswith("gate FAILED: significantly more violations: p 6.0e-08 at level")
    assert lines[1] == (
        f"{SHOWN + 7} pairs flown, 0 of them the same flight to the byte, 0 inconclusive and left "
        "out"
    )
    assert lines[2].startswith(f"violations 1 -> {SHOWN + 6} ({SHOWN + 5} more, 0 fewer): p ")
    assert lines[3] == (
        "aborts 1 -> 0 (0 more, 1 fewer): p 1.000, for both tests 1.000, level 0.05"
    )
    assert "broke    lawn-0: landed -> IV:dog:descent:seen" in lines
    assert "broke    and 5 more" in lines
    assert f"mended   lawn-{SHOWN + 5}: aborted -> landed" in lines
    assert lines[-1] == f"changed  lawn-{SHOWN + 6}: IV:dog:descent:seen -> II:lost:descent"


def test_the_same_flight_to_the_byte_is_counted() -> None:
    one, other = (
        Answer(outcome="landed", signature="", sha256=digest) for digest in ("ab" * 32, "cd" * 32)
    )
    pairs = [Pair(name="a", base=one, head=one), Pair(name="b", base=one, head=other)]
    assert "1 of them the same flight" in list(compare(pairs).summary())[1]
