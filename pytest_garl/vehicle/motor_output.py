"""From a wanted acceleration and throttle to the four motors: attitude, rates, mixer."""

from __future__ import annotations

import math

from pytest_garl.landing_system import MotorThrusts, VehicleState
from pytest_garl.vehicle.attitude import AttitudeControl
from pytest_garl.vehicle.mixer import FREE, mixed
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.position import GRAVITY_MPS2
from pytest_garl.vehicle.rate_control import RateControl
from pytest_garl.vehicle.rotations import Quaternion
from pytest_garl.vehicle.shaping import Pair, clamped
from pytest_garl.vehicle.touchdown_detector import (
    MAX_TILT_ERROR_RAD,
    MAX_TILT_REQUEST_RAD,
)

MIX_UP_PER_S = 2.0
MIX_DOWN_PER_S = 0.5
"""ArduPilot's slew rates of the priority of attitude over throttle."""


class MotorOutput:
    """The inner loops of one vehicle; ``limits`` tells what the mixer had to cut last.

    ``tilt_request_rad`` is the tilt that the last call asked for.
    """

    def __init__(self, parameters: ArduPilotParameters, dt_s: float, full_n: float) -> None:
        self._parameters, self._dt, self._full_n = parameters, dt_s, full_n
        self._attitude = AttitudeControl(parameters, dt_s)
        self._rates = RateControl(parameters, dt_s)
        self._mix = parameters.atc_thr_mix_min
        self.limits = FREE
        self.tilt_request_rad = 0.0

    def reset(self, attitude: Quaternion) -> None:
        """Keep the loops ready while the vehicle stands."""
        self._attitude.reset(attitude)
        self._rates.reset()
        self.limits = FREE

    @property
    def tilt_error_rad(self) -> float:
        """Angle between the thrust axis and the one that the attitude loop wants."""
        return self._attitude.tilt_error_rad

    @property
    def throttle_low(self) -> bool:
        """Whether the motors cannot turn slower and attitude has no priority over throttle."""
        return self.limits.lower and self._mix <= self._parameters.atc_thr_mix_min

    def thrusts(
        self,
        state: VehicleState,
        wanted_mps2: Pair,
        throttle: float,
        *,
        yaw: float,
        top: float,
        calm: bool,
    ) -> MotorThrusts:
        """Return the thrusts for a horizontal acceleration, a throttle and a heading in radians.

        ``top`` is the most that the spool allows; ``calm`` tells that the vehicle comes down
        without feeling anything, so that throttle goes before attitude.
        """
        p, (ax, ay) = self._parameters, wanted_mps2
        rates = self._attitude.rates((ax, ay, GRAVITY_MPS2), yaw, state.attitude)
        roll, pitch, turn = self._rates.outputs(rates, state.angular_velocity_radps, self.limits)
        tangent = math.sqrt(ax * ax + ay * ay) / GRAVITY_MPS2
        self.tilt_request_rad = math.atan(tangent)
        if p.atc_angle_boost:
            throttle *= math.sqrt(1 + tangent * tangent)
        self._choose_priority(calm)
        lift = max(0.0, throttle)
        shares, self.limits = mixed(
            roll,
            pitch,
            turn,
            throttle,
            average_max=lift * (1 - self._mix) + p.mot_thst_hover * self._mix,
            yaw_headroom=p.mot_yaw_headroom,
            top=top,
        )
        full = self._full_n
        a, b, c, d = shares
        return MotorThrusts(newtons=(a * full, b * full, c * full, d * full))

    def _choose_priority(self, calm: bool) -> None:
        """Choose how far attitude may raise the throttle: little only while coming down."""
        p = self._parameters
        level = (
            self.tilt_request_rad < MAX_TILT_REQUEST_RAD
            and self._attitude.tilt_error_rad < MAX_TILT_ERROR_RAD
        )
        wanted = p.atc_thr_mix_min if calm and level else p.atc_thr_mix_max
        up, down = MIX_UP_PER_S * self._dt, MIX_DOWN_PER_S * self._dt
        self._mix = clamped(wanted, self._mix - down, self._mix + up)
