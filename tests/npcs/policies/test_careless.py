"""A careless NPC comes at its phase, crosses its point, may pause there, and leaves."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.stories import NEVER, TICK_S, scenario_with, walk

CARELESS = {"grade": 0.0, "crosses_x_m": 1.0, "crosses_y_m": -0.5}


def nearest(places: np.ndarray) -> tuple[float, float]:
    """Return the least distance from the crossing, and when it was reached."""
    distances = np.hypot(places[:, 0] - 1.0, places[:, 1] + 0.5)
    return float(distances.min()), float(distances.argmin() * TICK_S)


@pytest.mark.parametrize(("name", "speed"), [("person-1", 1.4), ("dog-1", 4.0), ("bird-1", 9.0)])
def test_it_crosses_its_point_and_leaves(name: str, speed: float) -> None:
    scenario = scenario_with(name, (-8.0, -4.0), speed, {**CARELESS, "delay_s": 2.0})
    places = walk(scenario, name, seconds=30)
    distance, when = nearest(places)
    assert distance < 0.6
    assert when > 2.0
    assert np.hypot(*places[-1, :2]) > 9.5


def test_it_does_not_come_before_its_phase() -> None:
    scenario = scenario_with("person-1", (-8.0, 0.0), 1.4, {**CARELESS, "phase": 2.0})
    waiting = walk(scenario, "person-1", seconds=20)
    assert np.ptp(waiting[:, 0]) == 0
    coming = walk(scenario, "person-1", seconds=20, moments=(0.0, 5.0, 8.0, NEVER))
    moved = np.flatnonzero(np.diff(coming[:, 0]) != 0)
    assert 7.9 < moved[0] * TICK_S < 8.6


def test_it_stands_at_its_point_for_its_pause() -> None:
    values = {**CARELESS, "pause_s": 12.0}
    places = walk(scenario_with("person-1", (-5.0, 0.0), 1.4, values), "person-1", seconds=40)
    at_point = np.hypot(places[:, 0] - 1.0, places[:, 1] + 0.5) < 0.6
    assert 11.5 < at_point.sum() * TICK_S < 14.5
    assert np.hypot(*places[-1, :2]) > 9.5


def test_it_knows_nothing_of_the_uav() -> None:
    scenario = scenario_with("person-1", (-8.0, -4.0), 1.4, CARELESS)
    far = walk(scenario, "person-1", seconds=15, uav=lambda time_s: (9.0, 9.0, 9.0))
    near = walk(scenario, "person-1", seconds=15, uav=lambda time_s: (-8.0, -4.0, 2.0))
    assert (far == near).all()
