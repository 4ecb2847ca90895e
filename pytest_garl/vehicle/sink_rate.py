"""Descent speed of LAND."""

from __future__ import annotations

from pytest_garl.vehicle.parameters import ArduPilotParameters
from pytest_garl.vehicle.shaping import clamped, sqrt_controller

SLOW_BELOW_M = 2.0
SLOW_ABOVE_M = 0.35
SLOW_ERROR_M = 0.15
SLOWEST_MPS = 0.10
"""With a landing target in sight ArduPilot nearly stops between 2 m and 0.35 m for an error of
0.15 m, and descends with half of LAND_SPEED where there is none."""


def descent_rate(height_m: float, parameters: ArduPilotParameters) -> float:
    """Return the climb rate (negative) of a landing at a height above the ground.

    Fast above ``LAND_ALT_LOW``, then slowing down as a square-root controller of the height
    above it does, and ``LAND_SPEED`` to the ground.
    """
    p = parameters
    fast = p.land_speed_high or p.wpnav_speed_dn
    low = max(1.0, p.land_alt_low)
    rate = sqrt_controller(p.psc_posz_p, p.wpnav_accel_z)(low - height_m)
    return clamped(rate, -max(fast, p.land_speed), -p.land_speed)


def descent_rate_over_target(
    rate: float, height_m: float, error_m: float, parameters: ArduPilotParameters
) -> float:
    """Return the climb rate in m/s of a landing that sees its target ``error_m`` aside.

    None beyond ``PLND_XY_DIST_MAX`` (0 switches that off), slow near the ground.
    """
    p = parameters
    if p.plnd_xy_dist_max > 0 and error_m > p.plnd_xy_dist_max:
        return 0.0
    if SLOW_ABOVE_M < height_m < SLOW_BELOW_M:
        half = 0.5 * p.land_speed
        return min(-SLOWEST_MPS, -half + error_m * half / SLOW_ERROR_M)
    return rate
