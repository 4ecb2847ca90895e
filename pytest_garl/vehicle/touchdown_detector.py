"""The land detector: the vehicle stands if all signs of standing last for a second."""

from __future__ import annotations

import math

from pytest_garl.vehicle.filters import smoothing
from pytest_garl.vehicle.rotations import Vector

LAND_AFTER_S = 1.0
MAYBE_AFTER_S = 0.2
MAX_TILT_REQUEST_RAD = math.radians(15)
MAX_TILT_ERROR_RAD = math.radians(30)
MAX_ACCELERATION_MPS2 = 1.0
MAX_VERTICAL_SPEED_MPS = 1.0
MAX_HEIGHT_M = 2.0
"""ArduPilot's documented conditions (copter/docs/land-mode.html); the height is that of its
rangefinder, for a vehicle that has one."""
ACCELERATION_FILTER_HZ = 1.0


class LandDetector:
    """Feed it every control step."""

    def __init__(self, dt_s: float) -> None:
        self._dt = dt_s
        self._part = smoothing(ACCELERATION_FILTER_HZ, dt_s)
        self.reset(landed=True)

    def reset(self, *, landed: bool) -> None:
        """Begin anew on the ground or in the air."""
        self.landed = self.maybe_landed = landed
        self._count_s = LAND_AFTER_S if landed else 0.0
        self._ax = self._ay = self._az = 0.0

    @property
    def acceleration_mps2(self) -> float:
        """Length of the low-passed acceleration."""
        return math.sqrt(self._ax * self._ax + self._ay * self._ay + self._az * self._az)

    def update(
        self,
        *,
        throttle_low: bool,
        tilt_request_rad: float,
        tilt_error_rad: float,
        acceleration: Vector,
        climb_mps: float,
        height_m: float,
    ) -> None:
        """Take one step; ``throttle_low``: the vertical control asks for the least there is."""
        part = self._part
        self._ax += part * (acceleration[0] - self._ax)
        self._ay += part * (acceleration[1] - self._ay)
        self._az += part * (acceleration[2] - self._az)
        if (
            throttle_low
            and tilt_request_rad < MAX_TILT_REQUEST_RAD
            and tilt_error_rad < MAX_TILT_ERROR_RAD
            and abs(climb_mps) < MAX_VERTICAL_SPEED_MPS
            and height_m < MAX_HEIGHT_M
            and self.acceleration_mps2 < MAX_ACCELERATION_MPS2
        ):
            self._count_s += self._dt
        else:
            self._count_s = 0.0
        self.landed = self._count_s >= LAND_AFTER_S
        self.maybe_landed = self._count_s >= MAYBE_AFTER_S
