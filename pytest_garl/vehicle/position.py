"""Horizontal control: position to velocity to acceleration, as a vector in the plane."""

from __future__ import annotations

import math

from pytest_garl.vehicle.filters import smoothing
from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.shaping import Pair, ShapedPlane, sqrt_controller

GRAVITY_MPS2 = 9.80665
"""Standard gravity."""


class HorizontalControl:
    """Follows a shaped target in the plane and returns the wanted acceleration."""

    def __init__(self, parameters: ArduPilotParameters, dt_s: float) -> None:
        p = parameters
        self._p, self._dt = p, dt_s
        self._of_error = smoothing(p.psc_velxy_flte, dt_s)
        self._of_derivative = smoothing(p.psc_velxy_fltd, dt_s)
        self._pull = sqrt_controller(p.psc_posxy_p, p.wpnav_accel)
        self._most = GRAVITY_MPS2 * math.tan(p.angle_max)
        self.target = ShapedPlane(p.wpnav_accel, p.psc_jerk_xy, dt_s)
        self.reset((0.0, 0.0), (0.0, 0.0))

    def reset(self, position: Pair, velocity: Pair) -> None:
        """Forget the past and hold from here, at the present velocity."""
        self.target.reset(position, velocity)
        self._error = self._derivative = self._integral = (0.0, 0.0)
        self._limited = False

    def relax(self, position: Pair, velocity: Pair) -> None:
        """Let the target follow the vehicle, so that nothing pulls while it stands."""
        self.target.reset(position, velocity)
        self._error = self._derivative = (0.0, 0.0)

    def acceleration(self, position: Pair, velocity: Pair) -> Pair:
        """Return the wanted acceleration (ax, ay) in m/s² for the target as it is."""
        p, dt, target = self._p, self._dt, self.target
        (tx, ty), (wx, wy), (ax, ay) = target.position, target.velocity, target.acceleration
        ex, ey = tx - position[0], ty - position[1]
        distance = math.sqrt(ex * ex + ey * ey)
        if distance > 0:
            share = self._pull(distance) / distance
            wx, wy = wx + share * ex, wy + share * ey
        old_x, old_y = self._error
        part = self._of_error
        error_x = old_x + part * (wx - velocity[0] - old_x)
        error_y = old_y + part * (wy - velocity[1] - old_y)
        part = self._of_derivative
        slope_x, slope_y = self._derivative
        slope_x += part * ((error_x - old_x) / dt - slope_x)
        slope_y += part * ((error_y - old_y) / dt - slope_y)
        self._error, self._derivative = (error_x, error_y), (slope_x, slope_y)
        ix, iy = self._integrate(error_x, error_y)
        ax += p.psc_velxy_p * error_x + ix + p.psc_velxy_d * slope_x
        ay += p.psc_velxy_p * error_y + iy + p.psc_velxy_d * slope_y
        size = math.sqrt(ax * ax + ay * ay)
        self._limited = size > self._most
        if self._limited:
            ax, ay = ax * self._most / size, ay * self._most / size
        return ax, ay

    def _integrate(self, error_x: float, error_y: float) -> Pair:
        ix, iy = self._integral
        # At the lean limit the integral may shrink but not grow.
        if not self._limited or ix * error_x + iy * error_y < 0:
            gain, most = self._p.psc_velxy_i * self._dt, self._p.psc_velxy_imax
            ix, iy = ix + gain * error_x, iy + gain * error_y
            size = math.sqrt(ix * ix + iy * iy)
            if size > most:
                ix, iy = ix * most / size, iy * most / size
            self._integral = ix, iy
        return ix, iy
