"""The estimate of how often landings fail, and how often its interval holds the truth."""

from __future__ import annotations

import itertools
import math

import pytest

from pytest_garl.reports.failure_probability import SamplePart, failure_probability
from pytest_garl.verdicts.statistics import share_interval

REGION_SHARE = 0.25


def part(failing: int, flights: int, share: float = 1.0) -> SamplePart:
    return SamplePart(how="use", share=share, flights=flights, failing=failing)


def strata(inside: tuple[int, int], outside: tuple[int, int]) -> list[SamplePart]:
    return [part(*inside, REGION_SHARE), part(*outside, 1 - REGION_SHARE)]


@pytest.mark.parametrize(("failing", "flights"), [(0, 20), (1, 20), (30, 400), (20, 20)])
def test_plain_draws_have_their_share_and_its_exact_interval(failing: int, flights: int) -> None:
    found = failure_probability([part(failing, flights)])
    assert found is not None
    assert found.share == failing / flights
    assert (found.low, found.high) == share_interval(failing, flights)


def test_strata_count_as_often_as_they_occur() -> None:
    found = failure_probability(strata((50, 100), (10, 100)))
    assert found is not None
    assert found.share == pytest.approx(0.25 * 0.5 + 0.75 * 0.1)
    assert found.low < found.share < found.high


def test_plain_draws_and_strata_are_averaged_by_their_flights() -> None:
    found = failure_probability([part(10, 100), *strata((75, 150), (0, 150))])
    assert found is not None
    assert found.share == pytest.approx(0.25 * 0.1 + 0.75 * 0.25 * 0.5)


def test_flights_that_all_land_leave_an_upper_limit() -> None:
    found = failure_probability(strata((0, 100), (0, 100)))
    assert found is not None
    assert (found.share, found.low) == (0, 0)
    assert share_interval(0, 200)[1] < found.high < 0.05


def test_a_stratum_without_flights_leaves_the_plain_draws_alone() -> None:
    found = failure_probability([part(3, 40), *strata((4, 5), (0, 0))])
    assert found == failure_probability([part(3, 40)])


def test_without_a_sample_of_use_nothing_is_estimated() -> None:
    assert failure_probability([]) is None
    assert failure_probability([part(0, 0)]) is None


@pytest.mark.parametrize("flights", [(20, 20), (60, 60)])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0, 3.9])
def test_the_interval_holds_the_truth_as_often_as_it_says(
    flights: tuple[int, int], ratio: float
) -> None:
    """All outcomes are counted, each with its probability; ``ratio`` 1 is a useless region."""
    outcomes = list(itertools.product(*(range(each + 1) for each in flights)))
    intervals = {
        each: failure_probability(strata((each[0], flights[0]), (each[1], flights[1])))
        for each in outcomes
    }
    for truth in (0.003, 0.01, 0.03, 0.1, 0.25):
        inside = ratio * truth
        outside = (truth - REGION_SHARE * inside) / (1 - REGION_SHARE)
        shares = [
            _binomial(flights[0], inside),
            _binomial(flights[1], outside),
        ]
        held = math.fsum(
            shares[0][first] * shares[1][second]
            for (first, second), found in intervals.items()
            if found is not None and found.low <= truth <= found.high
        )
        assert held >= 0.94


def _binomial(count: int, share: float) -> list[float]:
    return [
        math.comb(count, each) * share**each * (1 - share) ** (count - each)
        for each in range(count + 1)
    ]
