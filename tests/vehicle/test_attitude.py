from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pytest_garl.vehicle import (
    ArduPilotParameters,
)
from pytest_garl.vehicle.attitude import AttitudeControl
from pytest_garl.vehicle.rotations import (
    heading_quaternion,
    rotate,
    rotation_between,
    tilt_and_turn,
    yaw_of,
)

DT = 1 / 240
P = ArduPilotParameters()


def test_a_rotation_splits_into_tilt_and_turn() -> None:
    yaw = heading_quaternion((0.0, 0.0, 1.0), 0.7)
    assert tilt_and_turn(yaw) == pytest.approx((0.0, 0.0, 0.7))
    # A thrust that leans east is a positive turn about y (north).
    lean = heading_quaternion((math.sin(0.2), 0.0, math.cos(0.2)), 0.0)
    assert tilt_and_turn(lean) == pytest.approx((0.0, 0.2, 0.0))
    both = heading_quaternion((math.sin(0.2), 0.0, math.cos(0.2)), 0.7)
    assert tilt_and_turn(both) == pytest.approx((0.0, 0.2, 0.7))
    assert rotate(both, (0.0, 0.0, 1.0)) == pytest.approx((math.sin(0.2), 0.0, math.cos(0.2)))
    assert yaw_of(yaw) == pytest.approx(0.7)
    assert rotation_between(both, both) == pytest.approx((0.0, 0.0, 0.0, 1.0))


def test_a_turn_goes_the_short_way_round() -> None:
    a = heading_quaternion((0.0, 0.0, 1.0), math.radians(170))
    b = heading_quaternion((0.0, 0.0, 1.0), math.radians(-170))
    assert tilt_and_turn(rotation_between(a, b))[2] == pytest.approx(math.radians(20))


def test_the_attitude_target_turns_no_faster_than_it_may() -> None:
    control = AttitudeControl(P, DT)
    last, fastest, hardest = 0.0, 0.0, 0.0
    speed = 0.0
    for _ in range(240 * 4):
        control.rates((0.0, 0.0, 9.8), math.pi / 2, control.target)
        yaw = yaw_of(control.target)
        hardest = max(hardest, abs((yaw - last) / DT - speed) / DT)
        speed, last = (yaw - last) / DT, yaw
        fastest = max(fastest, speed)
    assert fastest == pytest.approx(math.radians(60), rel=0.01)
    assert hardest <= math.radians(270) * 1.02
    assert last == pytest.approx(math.pi / 2, abs=0.002)


def test_heading_is_given_up_while_the_thrust_points_far_off() -> None:
    control = AttitudeControl(replace(P, atc_rate_ff_enab=False), DT)
    level, thrust = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 9.8)
    small = control.rates(thrust, 0.3, level)
    assert small[2] > 0.5
    leaning = heading_quaternion((0.0, math.sin(1.1), math.cos(1.1)), 0.0)
    far = control.rates(thrust, 0.3, leaning)
    assert far[2] == 0.0
    assert far[0] > 1.0
