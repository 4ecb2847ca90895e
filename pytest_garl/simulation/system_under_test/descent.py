"""Descent onto a known marker, for the reference pilot and the UAVs of the surrogate."""

from __future__ import annotations

import math

from pytest_garl.landing_system import Command, Land, VelocitySetpoint

LAND_BELOW_M = 0.35
LANDING_SPEED_MPS = 0.4
SLOW_BELOW_M = 1.5
CENTRED_WITHIN_M = 0.3
"""A pilot descends only within this horizontal distance of the marker's centre."""


def descend(
    marker_m: tuple[float, float], position_m: tuple[float, float, float], descent_mps: float
) -> Command:
    """Return the next command of a descent: half the speed near the ground, then ``Land``."""
    x, y, height = position_m
    if height < LAND_BELOW_M:
        return Land(speed_mps=LANDING_SPEED_MPS)
    speed_mps = descent_mps if height > SLOW_BELOW_M else 0.5 * descent_mps
    climb = -speed_mps if math.dist((x, y), marker_m) < CENTRED_WITHIN_M else 0.0
    return VelocitySetpoint(velocity_mps=(*centring_velocity(marker_m, (x, y)), climb))


def centring_velocity(
    marker_m: tuple[float, float], position_m: tuple[float, float]
) -> tuple[float, float]:
    """Return the horizontal velocity (x, y) towards the marker, at most 1 m/s per axis."""
    vx, vy = (
        max(-1.0, min(1.0, 1.2 * (aim - own)))
        for aim, own in zip(marker_m, position_m, strict=True)
    )
    return vx, vy
