"""Vertical control: position to velocity to acceleration to throttle."""

from __future__ import annotations

from pytest_garl.vehicle.filters import smoothing
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.pid import Pid
from pytest_garl.vehicle.shaping import (
    ShapedAxis,
    clamped,
    sqrt_controller,
    stopping_distance,
)

THROTTLE_PER_MPS2 = 0.1
"""ArduPilot counts PSC_ACCZ in cm/s² and thousandths of the throttle."""


class VerticalControl:
    """Follows a shaped target height (m, s) and returns the throttle of a level vehicle."""

    def __init__(self, parameters: ArduPilotParameters, dt_s: float) -> None:
        p = parameters
        self._p = p
        self._pull = sqrt_controller(p.psc_posz_p, p.wpnav_accel_z)
        self._of_error = smoothing(p.psc_velz_flte, dt_s)
        self._error_up = stopping_distance(p.wpnav_speed_up, p.psc_posz_p, p.wpnav_accel_z)
        self._error_down = stopping_distance(p.wpnav_speed_dn, p.psc_posz_p, p.wpnav_accel_z)
        self._accelerator = Pid(
            p.psc_accz_p * THROTTLE_PER_MPS2,
            p.psc_accz_i * THROTTLE_PER_MPS2,
            p.psc_accz_d * THROTTLE_PER_MPS2,
            p.psc_accz_imax,
            flte=p.psc_accz_flte,
            fltd=p.psc_accz_fltd,
            dt_s=dt_s,
        )
        self.target = ShapedAxis(p.wpnav_accel_z, p.psc_jerk_z, dt_s)
        self.velocity_target = 0.0
        self.reset(0.0, 0.0, p.mot_thst_hover)

    def reset(self, height: float, velocity: float, throttle: float) -> None:
        """Forget the past; the first throttle will be about ``throttle``."""
        self.target.reset(height, velocity)
        self._error = 0.0
        self._accelerator.reset(throttle - self._p.mot_thst_hover)

    def throttle(self, height: float, velocity: float, acceleration: float, limited: bool) -> float:
        """Return the throttle, 0 to 1 (not clipped); ``limited`` tells of the last one."""
        p, target = self._p, self.target
        error = clamped(target.position - height, -self._error_down, self._error_up)
        target.position = height + error
        self.velocity_target = target.velocity + self._pull(error)
        self._error += self._of_error * (self.velocity_target - velocity - self._error)
        wanted = target.acceleration + p.psc_velz_p * self._error
        return p.mot_thst_hover + self._accelerator.update(wanted, acceleration, limited)
