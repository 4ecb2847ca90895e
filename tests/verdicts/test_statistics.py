from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, mannwhitneyu

from pytest_garl.verdicts.statistics import mann_whitney, share_interval, vargha_delaney

values = st.lists(st.integers(0, 6).map(float), min_size=2, max_size=5)


@pytest.mark.parametrize(
    ("first", "second", "a12"),
    [
        ([3.0, 4.0], [1.0, 2.0], 1.0),
        ([1.0, 2.0], [3.0, 4.0], 0.0),
        ([1.0, 2.0], [1.0, 2.0], 0.5),
        # Of six pairs 5 beats three, 2 beats one and ties with one: (3 + 1 + 1/2) / 6.
        ([5.0, 2.0], [1.0, 2.0, 4.0], 4.5 / 6),
    ],
)
def test_a12_is_the_probability_that_a_value_is_larger(
    first: list[float], second: list[float], a12: float
) -> None:
    assert vargha_delaney(first, second) == pytest.approx(a12)


def test_p_of_three_against_three_is_at_least_a_tenth() -> None:
    # U = 9; of the 20 ways to deal six values out, this one and its mirror are as extreme.
    u, p = mann_whitney([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])
    assert [u, p] == pytest.approx([9, 2 / 20])


def test_equal_values_show_no_difference() -> None:
    assert mann_whitney([2.0, 2.0], [2.0, 2.0, 2.0]) == (3.0, 1.0)


def test_many_values_without_ties_agree_with_the_exact_distribution() -> None:
    first, second = [float(n) for n in range(0, 16, 2)], [float(n) for n in range(5, 19, 2)]
    u, p = mann_whitney(first, second)
    expected = mannwhitneyu(first, second, alternative="two-sided", method="exact")
    assert [u, p] == pytest.approx([expected.statistic, expected.pvalue])


def test_too_many_partitions_are_approximated() -> None:
    first, second = [float(n) for n in range(12)], [n + 0.5 for n in range(12)]
    expected = mannwhitneyu(first, second, alternative="two-sided", method="asymptotic")
    u, p = mann_whitney(first, second)
    assert [u, p] == pytest.approx([expected.statistic, expected.pvalue])


@settings(max_examples=40)
@given(values, values)
def test_p_is_the_share_of_partitions_at_least_as_extreme(
    first: list[float], second: list[float]
) -> None:
    u, p = mann_whitney(first, second)
    assert u == pytest.approx(len(first) * len(second) * vargha_delaney(first, second))
    pool = [*first, *second]
    deals = []
    for chosen in itertools.combinations(range(len(pool)), len(first)):
        rest = [pool[n] for n in range(len(pool)) if n not in chosen]
        deals.append(len(first) * len(second) * vargha_delaney([pool[n] for n in chosen], rest))
    more = sum(deal >= u - 1e-9 for deal in deals) / len(deals)
    less = sum(deal <= u + 1e-9 for deal in deals) / len(deals)
    assert p == pytest.approx(min(1.0, 2 * min(more, less)))


@pytest.mark.parametrize(("count", "total"), [(0, 40), (7, 40), (40, 40)])
def test_both_ends_of_the_interval_leave_the_tail_probability(count: int, total: int) -> None:
    low, high = share_interval(count, total)
    assert low <= count / total <= high
    if count:
        assert binom.sf(count - 1, total, low) == pytest.approx(0.025)
    if count < total:
        assert binom.cdf(count, total, high) == pytest.approx(0.025)


def test_interval_of_no_flights_is_zero_to_one() -> None:
    assert share_interval(0, 0) == (0.0, 1.0)


def test_interval_of_a_share_is_exact() -> None:
    # Clopper-Pearson for 0 of 10 is [0, 1 - 0.025^(1/10)].
    low, high = share_interval(0, 10)
    assert low == 0
    assert high == pytest.approx(1 - 0.025**0.1)
