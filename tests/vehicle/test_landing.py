from __future__ import annotations

import math
from dataclasses import replace

import pytest

from pytest_garl.vehicle import (
    ArduPilotParameters,
)
from pytest_garl.vehicle.guidance import ZERO, Setpoint
from pytest_garl.vehicle.sink_rate import (
    descent_rate,
    descent_rate_over_target,
)
from pytest_garl.vehicle.touchdown_detector import LandDetector

DT = 1 / 240
P = ArduPilotParameters()


def stand(detector: LandDetector, seconds: float, **change: float) -> bool:
    signs = {"tilt_request_rad": 0.0, "tilt_error_rad": 0.0, "climb_mps": 0.0, "height_m": 0.0}
    signs |= {key: value for key, value in change.items() if key in signs}
    for _ in range(round(seconds / DT)):
        detector.update(
            throttle_low=not change.get("throttle"),
            acceleration=(0.0, 0.0, change.get("acceleration", 0.0)),
            **signs,
        )
    return detector.landed


def in_the_air() -> LandDetector:
    detector = LandDetector(DT)
    detector.reset(landed=False)
    return detector


def test_it_has_landed_after_a_second_of_all_signs() -> None:
    detector = in_the_air()
    assert not stand(detector, 0.9)
    assert detector.maybe_landed
    assert stand(detector, 0.15)


@pytest.mark.parametrize(
    "missing",
    [
        {"throttle": 0.3},
        {"tilt_request_rad": math.radians(16)},
        {"tilt_error_rad": math.radians(31)},
        {"climb_mps": -1.1},
        {"height_m": 2.1},
        {"acceleration": 3.0},
    ],
)
def test_one_missing_sign_is_enough_to_fly_on(missing: dict[str, float]) -> None:
    assert not stand(in_the_air(), 3.0, **missing)


def test_a_bounce_restarts_the_landing_timer() -> None:
    detector = in_the_air()
    stand(detector, 0.8)
    stand(detector, DT, climb_mps=1.5)
    assert not stand(detector, 0.8)


def test_land_comes_down_fast_then_slow() -> None:
    assert descent_rate(30.0, P) == -1.5
    # 1 m above LAND_ALT_LOW: sqrt(2 * 1 * (1 - 0.5)) = 1.
    assert descent_rate(11.0, P) == pytest.approx(-1.0)
    assert descent_rate(9.0, P) == -0.5
    assert descent_rate(30.0, replace(P, land_speed_high=2.0)) == -2.0


def test_over_a_target_it_waits_far_off_and_is_careful_near_the_ground() -> None:
    assert descent_rate_over_target(-0.5, 6.0, 2.6, P) == 0.0
    assert descent_rate_over_target(-0.5, 6.0, 2.4, P) == -0.5
    assert descent_rate_over_target(-0.5, 6.0, 9.0, replace(P, plnd_xy_dist_max=0.0)) == -0.5
    assert descent_rate_over_target(-0.5, 1.0, 0.0, P) == pytest.approx(-0.25)
    assert descent_rate_over_target(-0.5, 1.0, 0.06, P) == pytest.approx(-0.15)
    assert descent_rate_over_target(-0.5, 1.0, 0.3, P) == pytest.approx(-0.10)
    assert descent_rate_over_target(-0.5, 0.3, 0.3, P) == -0.5


def test_a_moving_setpoint_moves_on_until_it_times_out() -> None:
    setpoint = Setpoint(
        time_s=10.0,
        position_m=(1.0, 0.0, 5.0),
        velocity_mps=(2.0, 0.0, 0.0),
        acceleration_mps2=(0.0, 1.0, 0.0),
        speed_mps=10.0,
    )
    assert setpoint.at(10.5, 3.0) == ((2.0, 0.125, 5.0), (2.0, 0.5, 0.0), (0.0, 1.0, 0.0))
    place, velocity, _ = setpoint.at(20.0, 3.0)
    assert place == (7.0, 4.5, 5.0)
    assert velocity == ZERO
