"""A dog that chases leaps at a UAV in reach: to its height, straight on, and down again."""

from __future__ import annotations

import numpy as np

from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES
from tests.support.stories import TICK_S, Vector, scenario_with, walk

DOG = OBJECT_TYPES["dog"]
CHASING = {"grade": float(GRADES.index("chasing")), "lasts_s": 5.0}


def _scenario(values: dict[str, float]) -> Scenario:
    return scenario_with("dog-1", (6.0, 0.0), 6.0, values)


def _places(values: dict[str, float], height_m: float, seconds: float = 8.0) -> np.ndarray:
    def hovering(time_s: float) -> Vector:
        return 0.0, 0.0, height_m

    return walk(_scenario(values), "dog-1", seconds=seconds, uav=hovering)


def test_a_chasing_dog_leaps_at_a_low_uav_and_lands_again() -> None:
    places = _places(CHASING, height_m=1.5)
    height = places[:, 2]
    assert 0.95 < height.max() <= DOG.leap_m
    assert height[-1] == 0.0
    airborne = np.flatnonzero(height > 0)
    first = airborne[: np.flatnonzero(np.diff(airborne) > 1)[0] + 1]
    # 2 sqrt(2 h / g)
    assert 0.85 < len(first) * TICK_S < 0.95
    fall = np.diff(height[first], 2) / TICK_S**2
    np.testing.assert_allclose(fall, -9.81, atol=1e-6)


def test_a_dog_leaps_at_where_the_uav_was_half_a_second_ago() -> None:
    def coming_down(time_s: float) -> Vector:
        return 0.0, 0.0, max(0.4, 9.0 - 1.5 * time_s)

    # It runs round a UAV that comes down, and leaps when it knows that it is in reach.
    places = walk(_scenario(CHASING | {"delay_s": 3.0}), "dog-1", seconds=12, uav=coming_down)
    leap = int(np.flatnonzero(places[:, 2] > 0)[0]) * TICK_S
    assert coming_down(leap - 0.5)[2] <= DOG.height_m + DOG.leap_m


def test_a_dog_in_the_air_flies_straight_on() -> None:
    places = _places(CHASING, height_m=1.5)
    leap = int(np.flatnonzero(places[:, 2] > 0)[0])
    steps = np.diff(places[leap : leap + round(0.8 / TICK_S), :2], axis=0)
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), atol=1e-9)


def test_a_dog_does_not_leap_at_what_is_out_of_reach() -> None:
    assert _places(CHASING, height_m=2.5)[:, 2].max() == 0.0


def test_only_a_dog_that_chases_leaps() -> None:
    for grade in ("careless", "curious"):
        values = {"grade": float(GRADES.index(grade)), "lasts_s": 5.0}
        assert _places(values, height_m=1.2)[:, 2].max() == 0.0
