"""A bird of a story comes from afar at its time, and stoops within what it can dive and climb."""

from __future__ import annotations

import numpy as np

from pytest_garl.scenarios.object_types import OBJECT_TYPES
from tests.support.stories import TICK_S, scenario_with, walk

BIRD = OBJECT_TYPES["bird"]


def test_a_bird_is_far_away_until_it_comes() -> None:
    scenario = scenario_with("bird-1", (5.0, 0.0), 10.0, {"delay_s": 3.0})
    places = walk(scenario, "bird-1", seconds=10)
    distance = np.hypot(places[:, 0], places[:, 1])
    assert distance[: round(2.9 / TICK_S)].min() > 500
    came = int(np.flatnonzero(distance < 500)[0])
    assert 2.9 < came * TICK_S < 3.2
    assert distance[came] > 19.0
    assert distance.min() < 3.0


def test_a_careless_bird_is_lowest_where_it_crosses() -> None:
    values = {"crosses_x_m": 0.0, "stoop_m": 4.0}
    scenario = scenario_with("bird-1", (5.0, 0.0), 10.0, values, height_m=8.0)
    places = walk(scenario, "bird-1", seconds=20)
    near = np.hypot(places[:, 0], places[:, 1]) < 1.0
    assert near.any()
    assert places[near, 2].min() < 4.7
    assert places[-1, 2] > 6.0
    speed = np.diff(places[:, 2]) / TICK_S
    assert speed.min() >= -BIRD.dive_mps - 1e-6
    assert speed.max() <= BIRD.climb_mps + 1e-6


def test_a_bird_comes_down_no_lower_than_a_metre() -> None:
    values = {"stoop_m": 14.0}
    scenario = scenario_with("bird-1", (5.0, 0.0), 10.0, values, height_m=5.0)
    assert walk(scenario, "bird-1", seconds=12)[:, 2].min() >= 1.0
