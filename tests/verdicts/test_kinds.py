"""Hill numbers and rarefaction, against figures by hand and against every draw."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.verdicts.kinds import (
    hill_number,
    kinds_in_a_draw,
    kinds_in_flights,
    kinds_in_violations,
    range_of_kinds,
)

COUNTS = st.lists(st.integers(1, 4), max_size=4)


def draws(counts: Sequence[int], flights: int, drawn: int) -> list[int]:
    """Return how many kinds each possible draw shows."""
    shown = [kind for kind, count in enumerate(counts) for _ in range(count)]
    every = [*shown, *[-1] * (flights - len(shown))]
    return [len({*draw} - {-1}) for draw in itertools.combinations(every, drawn)]


@st.composite
def searches(draw: st.DrawFn) -> tuple[list[int], int, int]:
    counts = draw(COUNTS.filter(lambda counts: sum(counts) <= 9))
    flights = draw(st.integers(sum(counts), 10))
    return counts, flights, draw(st.integers(0, flights))


@pytest.mark.parametrize(
    ("counts", "hill"),
    [
        ([], (0, 0, 0)),
        ([7], (1, 1, 1)),
        ([5, 5, 5], (3, 3, 3)),
        # Shares 1/2, 1/4, 1/4: entropy 1.5 bits, and 1 / (1/4 + 1/16 + 1/16).
        ([2, 1, 1], (3, 2**1.5, 8 / 3)),
        # exp(-0.98 ln 0.98 - 0.02 ln 0.01), and 1 / (0.9604 + 0.0002).
        ([98, 1, 1], (3, 1.118403, 1.041016)),
    ],
)
def test_hill_numbers_agree_with_figures_by_hand(
    counts: list[int], hill: tuple[float, float, float]
) -> None:
    found = [hill_number(counts, order) for order in (0, 1, 2)]
    assert found == pytest.approx(hill, rel=1e-6)


@given(counts=st.lists(st.integers(0, 50), max_size=8))
def test_hill_numbers_fall_with_their_order_and_ignore_the_order_of_kinds(
    counts: list[int],
) -> None:
    zero, half, one, two = (hill_number(counts, order) for order in (0, 0.5, 1, 2))
    assert zero == pytest.approx(sum(count > 0 for count in counts))
    assert zero >= half - 1e-9
    assert half >= one - 1e-9
    assert one >= two - 1e-9
    assert hill_number(counts[::-1], 1) == pytest.approx(one)


@given(counts=COUNTS.filter(bool), factor=st.integers(2, 20))
def test_hill_numbers_depend_on_shares_alone_and_double_if_all_kinds_are_split(
    counts: list[int], factor: int
) -> None:
    for order in (0, 1, 2):
        plain = hill_number(counts, order)
        assert hill_number([count * factor for count in counts], order) == pytest.approx(plain)
        assert hill_number([*counts, *counts], order) == pytest.approx(2 * plain)


def test_rarefaction_agrees_with_figures_by_hand() -> None:
    # Two of four violations: of six pairs one shows one kind twice, five show two kinds.
    assert kinds_in_violations([2, 1, 1], 2) == pytest.approx(11 / 6)
    # Two of five flights, one without a violation: four pairs with it show one kind.
    assert kinds_in_flights([2, 1, 1], 5, 2) == pytest.approx((4 * 1 + 11) / 10)
    # 1 - C(35, 5) / C(40, 5) and so on, of 40 flights.
    expected = sum(1 - math.comb(40 - n, 5) / math.comb(40, 5) for n in (12, 3, 1))
    assert kinds_in_flights([12, 3, 1], 40, 5) == pytest.approx(expected)


@given(search=searches())
def test_rarefaction_is_the_mean_of_all_draws(search: tuple[list[int], int, int]) -> None:
    counts, flights, drawn = search
    every = draws(counts, flights, drawn)
    assert kinds_in_flights(*search) == pytest.approx(sum(every) / len(every))
    if drawn <= sum(counts):
        every = draws(counts, sum(counts), drawn)
        assert kinds_in_violations(counts, drawn) == pytest.approx(sum(every) / len(every))


@given(search=searches())
def test_chances_of_numbers_of_kinds_are_those_of_all_draws(
    search: tuple[list[int], int, int],
) -> None:
    every = Counter(draws(*search))
    chances = kinds_in_a_draw(*search)
    expected = [every[kinds] / every.total() for kinds in range(len(search[0]) + 1)]
    assert chances == pytest.approx(np.array(expected), abs=1e-12)


@given(search=searches())
def test_range_covers_the_draws_and_nothing_narrower_at_its_ends_does(
    search: tuple[list[int], int, int],
) -> None:
    low, high = range_of_kinds(*search)
    every = draws(*search)
    outside = 0.025 * len(every)
    assert sum(kinds < low for kinds in every) <= outside
    assert sum(kinds <= low for kinds in every) >= outside
    assert sum(kinds > high for kinds in every) <= outside
    assert low <= high


@settings(max_examples=20)
@given(counts=st.lists(st.integers(1, 200), min_size=1, max_size=12))
def test_figures_of_large_searches_agree_with_each_other(counts: list[int]) -> None:
    flights = sum(counts) + 100
    chances = kinds_in_a_draw(counts, flights, 40)
    assert chances.sum() == pytest.approx(1)
    mean = float(chances @ np.arange(chances.size))
    assert kinds_in_flights(counts, flights, 40) == pytest.approx(mean)


def test_whole_search_shows_all_of_its_kinds() -> None:
    assert kinds_in_flights([5, 1], 9, 9) == 2
    assert range_of_kinds([5, 1], 9, 9) == (2, 2)
    assert kinds_in_violations([5, 1], 6) == 2


@pytest.mark.parametrize(("flights", "drawn"), [(9, 10), (5, 2), (9, -1)])
def test_impossible_draws_are_refused(flights: int, drawn: int) -> None:
    with pytest.raises(ValueError, match="flights with 6 violations"):
        kinds_in_flights([5, 1], flights, drawn)
