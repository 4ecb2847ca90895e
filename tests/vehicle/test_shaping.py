from __future__ import annotations

import math

import pytest

from pytest_garl.vehicle import (
    ArduPilotParameters,
)
from pytest_garl.vehicle.shaping import (
    ShapedAxis,
    ShapedPlane,
    sqrt_controller,
    stopping_distance,
)

DT = 1 / 240
P = ArduPilotParameters()


@pytest.mark.parametrize(
    ("error", "rate"),
    [
        (0.0, 0.0),
        (1.0, 2.0),  # linear up to limit / p² = 1.25
        (1.25, 2.5),
        (5.0, math.sqrt(2 * 5 * (5 - 0.625))),
        (-5.0, -math.sqrt(43.75)),
    ],
)
def test_the_sqrt_controller_is_linear_then_a_square_root(error: float, rate: float) -> None:
    assert sqrt_controller(2.0, 5.0)(error) == pytest.approx(rate)


def test_the_sqrt_controller_brakes_with_no_more_than_its_limit() -> None:
    rate, error, before, hardest = sqrt_controller(1.0, 2.5), 20.0, None, 0.0
    while error > 0.01:
        speed = rate(error)
        if before is not None:
            hardest = max(hardest, (before - speed) / DT)
        before = speed
        error -= speed * DT
    assert 2.3 < hardest < 2.52


@pytest.mark.parametrize("speed", [0.0, 0.4, 2.5, 9.0])
def test_the_stopping_distance_is_the_inverse_of_the_sqrt_controller(speed: float) -> None:
    assert sqrt_controller(1.0, 2.5)(stopping_distance(speed, 1.0, 2.5)) == pytest.approx(speed)


def test_a_shaped_axis_keeps_its_limits_and_arrives() -> None:
    axis = ShapedAxis(1.0, 5.0, DT)
    before, fastest, hardest, jerk = 0.0, 0.0, 0.0, 0.0
    for _ in range(round(18 / DT)):
        axis.towards(20.0, 0.0, -1.5, 2.5)
        fastest, hardest = max(fastest, axis.velocity), max(hardest, abs(axis.acceleration))
        jerk = max(jerk, abs(axis.acceleration - before) / DT)
        before = axis.acceleration
    assert fastest == pytest.approx(2.5, abs=0.01)
    assert hardest <= 1.0 + 1e-9
    assert jerk <= 5.0 + 1e-6
    assert axis.position == pytest.approx(20.0, abs=0.005)


def test_a_shaped_plane_is_no_faster_on_the_diagonal() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    fastest = 0.0
    for _ in range(round(26 / DT)):
        plane.towards((30.0, 40.0), top=3.0)
        fastest = max(fastest, math.hypot(*plane.velocity))
    assert 2.98 < fastest < 3.05
    assert plane.position == pytest.approx((30.0, 40.0), abs=0.05)


def test_a_shaped_plane_follows_a_moving_goal_without_lag() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    for step in range(round(15 / DT)):
        plane.towards((step * DT, 0.0), (1.0, 0.0), top=10.0)
    assert plane.position[0] == pytest.approx(15.0, abs=0.02)


def test_a_shaped_plane_stops_at_its_stopping_point_without_turning_back() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    plane.reset((1.0, 2.0), (3.0, 0.0))
    goal = plane.stopping_point()
    backwards = 0.0
    for _ in range(round(10 / DT)):
        plane.towards(goal, top=10.0)
        backwards = min(backwards, plane.velocity[0])
    assert plane.position == pytest.approx(goal, abs=0.01)
    assert backwards > -0.25
