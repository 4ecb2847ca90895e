from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.search.objectives import (
    NEAREST_MISS,
    SAFE_MARGINS,
    diversity,
    near_miss,
    violation_proximity,
)
from pytest_garl.verdicts.verdict import Excuse, Margin, MarginName
from tests.support.results import flight_result


def landed(**margins: float) -> FlightResult:
    found = tuple(_margin(name, value) for name, value in margins.items())
    return flight_result(margins=found)


def _margin(name: Any, value: float) -> Margin:
    return Margin(property=name, value=value, unit="1", decided=False)


def test_diversity_is_the_mean_distance_to_all_members() -> None:
    # Distances: 0-1 is 5, 0-2 is 0, 1-2 is 5; each sum is divided by all three members.
    generation = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 0.0]])
    assert diversity(generation) == pytest.approx([5 / 3, 10 / 3, 5 / 3])


def test_diversity_of_equal_chromosomes_is_zero() -> None:
    assert diversity(np.full((4, 3), 0.2)).tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize("name", sorted(SAFE_MARGINS))
def test_proximity_grows_as_a_margin_shrinks(name: MarginName) -> None:
    safe = SAFE_MARGINS[name]
    values = [2 * safe, safe, 0.6 * safe, 0.3 * safe, 0.01 * safe]
    near = [violation_proximity(landed(**{name: value})) for value in values]
    assert near == pytest.approx([0.0, 0.0, 0.4, 0.7, 0.99])


def test_the_nearest_property_counts_also_if_it_is_estimated() -> None:
    result = landed(distance=0.4, moving=2.4, dropout=0.5)
    assert near_miss(result) == ("dropout", 0.75)


def test_only_a_violation_has_proximity_one() -> None:
    assert violation_proximity(flight_result("IV:dog")) == 1.0
    assert violation_proximity(landed(decoy=-3.0)) == NEAREST_MISS < 1


def test_a_crash_that_did_not_happen_is_no_near_miss() -> None:
    assert near_miss(landed(crash=1.0)) == ("", 0.0)


@pytest.mark.parametrize(
    ("excuse", "expected"), [("blocked", ("moving", 0.9)), ("undetectable", ("", 0.0))]
)
def test_an_excused_flight_is_no_near_miss_of_a_landing(
    excuse: Excuse, expected: tuple[str, float]
) -> None:
    margins = (_margin("distance", -5.0), _margin("time", 0.0), _margin("moving", 0.3))
    name, near = near_miss(flight_result(outcome="gave_up", margins=margins, excuse=excuse))
    assert name == expected[0]
    assert near == pytest.approx(expected[1])
