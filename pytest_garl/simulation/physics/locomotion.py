"""How a body starts, stops and turns: it goes where it faces, within its type's limits."""

from __future__ import annotations

import math

from pytest_garl.scenarios.object_types import ObjectType

STANDING_MPS = 0.05
"""A body slower than this turns on the spot."""
TIRING_S = 1.0
"""A body slows down over about this time when its reserve ends: engineering estimate."""
EDGE_M = 20.0
"""A flying body turns back so far outside the bounds, where no fence holds it: engineering
estimate, three turns at its least speed, so that one that leaves the marker gets away from it."""

Plane = tuple[float, float]
Bounds = tuple[float, float, float, float]


def next_course(
    kind: ObjectType,
    velocity_mps: Plane,
    yaw_rad: float,
    wanted_mps: Plane,
    dt_s: float,
    flies: bool,
) -> tuple[float, float]:
    """Return the course and the speed after ``dt_s``.

    A body turns towards the wanted velocity and slows down the more, the farther it has to turn.  A
    body that ``flies`` keeps its least speed, and circles to the left if the wanted velocity is 0.
    """
    speed = math.hypot(*velocity_mps)
    course = yaw_rad if speed < STANDING_MPS else math.atan2(velocity_mps[1], velocity_mps[0])
    least = kind.least_speed_mps if flies else 0.0
    asked = math.hypot(*wanted_mps)
    if asked > 0:
        turn = math.remainder(math.atan2(wanted_mps[1], wanted_mps[0]) - course, 2 * math.pi)
    else:
        turn = math.pi / 2 if flies else 0.0
    pace = max(least, asked * max(0.0, math.cos(turn)))
    largest = kind.turn_rate_radps * dt_s
    if speed * largest > kind.lateral_mps2 * dt_s:
        largest = kind.lateral_mps2 * dt_s / speed
    course += min(largest, max(-largest, turn))
    slower, faster = kind.braking_mps2 * dt_s, kind.acceleration_mps2 * dt_s
    return course, min(speed + faster, max(speed - slower, pace))


def limit_mps(kind: ObjectType, reserve_m: float) -> float:
    """Return the speed that a body can run with what is left of its reserve.

    The reserve is the distance that it can still run beyond what it can keep up, its critical
    speed (Monod and Scherrer 1965, Hughson et al. 1984).
    """
    return kind.sustained_speed_mps + reserve_m / TIRING_S


def reserve_after(kind: ObjectType, reserve_m: float, speed_mps: float, dt_s: float) -> float:
    """Return the reserve after running at a speed: faster than it can keep up spends it."""
    if kind.burst_m == 0:
        return reserve_m
    left = reserve_m - (speed_mps - kind.sustained_speed_mps) * dt_s
    return min(kind.burst_m, max(0.0, left))


def is_far_out(place_m: Plane, bounds_m: Bounds) -> bool:
    """Whether a flying body is so far outside the bounds that it turns back."""
    (x, y), (x_min, x_max, y_min, y_max) = place_m, bounds_m
    return max(x_min - x, x - x_max, y_min - y, y - y_max) > EDGE_M


def to_the_middle(place_m: Plane, bounds_m: Bounds) -> float:
    """Return the course to the middle of the map."""
    (x, y), (x_min, x_max, y_min, y_max) = place_m, bounds_m
    return math.atan2((y_min + y_max) / 2 - y, (x_min + x_max) / 2 - x)
