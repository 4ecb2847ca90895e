from __future__ import annotations

import math

from pytest_garl.shrinking.escape_plan import GONE_S, UP, candidates, directions
from pytest_garl.simulation.physics.flight_control import MAX_CLIMB_MPS, MAX_DESCENT_MPS

UAV, BODY = (0.0, 0.0, 3.0), (-2.0, 0.0, 0.0)


def test_directions_keep_the_limits_of_climb_and_descent_and_begin_upwards() -> None:
    found = [*directions(UAV, BODY)]
    assert found[0] == UP
    assert all(-MAX_DESCENT_MPS <= z <= MAX_CLIMB_MPS for _, _, z in found)
    assert len(found) == len(set(found)) == 26


def test_level_directions_begin_straight_away_from_the_body() -> None:
    level = [(x, y) for x, y, z in directions(UAV, BODY) if z == 0.0]
    assert level[0] == (8.0, 0.0)
    headings = [round(math.degrees(math.atan2(y, x))) % 360 for x, y in level]
    assert headings == [0, 45, 315, 90, 270, 135, 225, 180]


def test_escapes_last_until_after_the_contact() -> None:
    for legs in candidates(UAV, BODY, 1.5):
        assert sum(leg.duration_s for leg in legs) >= 1.5 + GONE_S
