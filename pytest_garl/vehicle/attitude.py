"""Attitude control: a wanted thrust direction and heading to body rates."""

from __future__ import annotations

import math

from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.rotations import (
    Quaternion,
    Vector,
    heading_quaternion,
    integrate_rates,
    rotate,
    rotation_between,
    tilt_and_turn,
    yaw_of,
)
from pytest_garl.vehicle.shaping import clamped, sqrt_controller

LARGE_TILT_ERROR_RAD = math.radians(30)
"""From here on ArduPilot gives the heading up in favour of the thrust's direction."""
MAX_YAW_ERROR_RAD = math.radians(45)
"""The heading target waits for a vehicle that lags behind by more."""
TILT_DECELERATION_RADPS2 = (math.radians(40), math.radians(720))
YAW_DECELERATION_RADPS2 = (math.radians(10), math.radians(120))
"""ArduPilot's bounds on the deceleration of its angle loops, itself half of ATC_ACCEL_*_MAX."""


class AttitudeControl:
    """Shapes an attitude target and turns the error from it into wanted body rates."""

    def __init__(self, parameters: ArduPilotParameters, dt_s: float) -> None:
        p = parameters
        self._p, self._dt = p, dt_s
        tilt, turn = TILT_DECELERATION_RADPS2, YAW_DECELERATION_RADPS2
        self._correct = (
            sqrt_controller(p.atc_ang_rll_p, clamped(p.atc_accel_r_max / 2, *tilt)),
            sqrt_controller(p.atc_ang_pit_p, clamped(p.atc_accel_p_max / 2, *tilt)),
            sqrt_controller(p.atc_ang_yaw_p, clamped(p.atc_accel_y_max / 2, *turn)),
        )
        quick = 1 / max(0.01, p.atc_input_tc)
        self._approach = (
            sqrt_controller(quick, p.atc_accel_r_max),
            sqrt_controller(quick, p.atc_accel_p_max),
            sqrt_controller(quick, p.atc_accel_y_max),
        )
        self.reset((0.0, 0.0, 0.0, 1.0))

    def reset(self, attitude: Quaternion) -> None:
        """Hold this heading, level; forget the past."""
        yaw = yaw_of(attitude)
        self.target: Quaternion = heading_quaternion((0.0, 0.0, 1.0), yaw)
        self._rates: Vector = (0.0, 0.0, 0.0)
        self.tilt_error_rad = 0.0

    def rates(self, thrust: Vector, yaw_rad: float, attitude: Quaternion) -> Vector:
        """Return wanted body rates for a thrust direction (world) and a heading."""
        self._shape(heading_quaternion(thrust, yaw_rad))
        error = rotation_between(attitude, self.target)
        ex, ey, ez = tilt_and_turn(error)
        if abs(ez) > MAX_YAW_ERROR_RAD:
            excess = ez - math.copysign(MAX_YAW_ERROR_RAD, ez)
            self.target = integrate_rates(self.target, (0.0, 0.0, -excess), 1.0)
            ez -= excess
        tilt = math.sqrt(ex * ex + ey * ey)
        self.tilt_error_rad = tilt
        correct_x, correct_y, correct_z = self._correct
        wx, wy, wz = correct_x(ex), correct_y(ey), correct_z(ez)
        if self._p.atc_rate_ff_enab:
            fx, fy, fz = rotate(error, self._rates)
            wx, wy, wz = wx + fx, wy + fy, wz + fz
        if tilt > LARGE_TILT_ERROR_RAD:
            wz *= max(0.0, 2 - tilt / LARGE_TILT_ERROR_RAD)
        return wx, wy, wz

    def _shape(self, wanted: Quaternion) -> None:
        """Move the target towards the wanted attitude with bounded angular acceleration."""
        p, dt = self._p, self._dt
        if not p.atc_rate_ff_enab:
            self.target, self._rates = wanted, (0.0, 0.0, 0.0)
            return
        ex, ey, ez = tilt_and_turn(rotation_between(self.target, wanted))
        wx, wy, wz = self._rates
        approach_x, approach_y, approach_z = self._approach
        slew, change = p.atc_slew_yaw, p.atc_accel_r_max * dt
        x = clamped(approach_x(ex), wx - change, wx + change)
        change = p.atc_accel_p_max * dt
        y = clamped(approach_y(ey), wy - change, wy + change)
        change = p.atc_accel_y_max * dt
        z = clamped(clamped(approach_z(ez), -slew, slew), wz - change, wz + change)
        self._rates = x, y, z
        self.target = integrate_rates(self.target, self._rates, dt)
