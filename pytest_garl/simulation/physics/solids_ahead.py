"""How a body gets past what is solid: a walker slides along it or stops, a bird flies around it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pytest_garl.scenarios.bodies import Disc
from pytest_garl.scenarios.object_types import ObjectType

_MARGIN_M = 0.3
_TURN_STEPS = 12

Plane = tuple[float, float]


def gap_m(solid: Disc, place_m: Plane) -> float:
    """Return the distance of a place from a solid's edge."""
    x, y = place_m
    return math.hypot(x - solid.x_m, y - solid.y_m) - solid.radius_m - 1e-9


def free_velocity(
    place_m: Plane,
    velocity_mps: Plane,
    radius_m: float,
    least_mps: float,
    dt_s: float,
    solids: Sequence[Disc],
) -> Plane:
    """Return the velocity along the solids that a body would touch in the next step.

    A walker stops where it cannot slide.  A flying body keeps its least speed on the nearest course
    that is free.
    """
    vx, vy = velocity_mps
    for solid in solids:
        x, y = place_m[0] + vx * dt_s, place_m[1] + vy * dt_s
        reach = solid.radius_m + radius_m
        nx, ny = x - solid.x_m, y - solid.y_m
        distance = math.hypot(nx, ny)
        if 0 < distance < reach:
            inward = (vx * nx + vy * ny) / distance
            if inward < 0:
                vx, vy = vx - inward * nx / distance, vy - inward * ny / distance
    if least_mps == 0:
        free = _is_free(place_m, (vx, vy), radius_m, dt_s, solids)
        return (vx, vy) if free else (0.0, 0.0)
    speed = math.hypot(vx, vy)
    course = math.atan2(vy, vx) if speed > 0 else math.atan2(velocity_mps[1], velocity_mps[0])
    pace = max(least_mps, speed)
    for turn in _turns():
        vx, vy = pace * math.cos(course + turn), pace * math.sin(course + turn)
        if _is_free(place_m, (vx, vy), radius_m, dt_s, solids):
            break
    return vx, vy


def course_around(
    place_m: Plane, course_rad: float, kind: ObjectType, solids: Sequence[Disc]
) -> float:
    """Return the course of a flying body that passes the nearest solid ahead on the nearer side.

    A walker stops at a solid and slides along it; a flying body cannot stop.
    """
    cos, sin = math.cos(course_rad), math.sin(course_rad)
    nearest, changed = 2 * kind.turn_radius_m, course_rad
    for solid in solids:
        dx, dy = solid.x_m - place_m[0], solid.y_m - place_m[1]
        ahead, aside = cos * dx + sin * dy, cos * dy - sin * dx
        reach = solid.radius_m + kind.radius_m + _MARGIN_M
        away = math.hypot(dx, dy)
        if ahead > 0 and abs(aside) < reach and away - reach < nearest:
            nearest = away - reach
            angle = math.asin(min(1.0, reach / away))
            changed = math.atan2(dy, dx) + (-angle if aside > 0 else angle)
    return changed


def _turns() -> list[float]:
    """Return turns from none to a half, alternately to the left and right."""
    step = math.pi / _TURN_STEPS
    return [0.0, *(sign * n * step for n in range(1, _TURN_STEPS + 1) for sign in (1, -1))]


def _is_free(
    place_m: Plane, velocity_mps: Plane, radius_m: float, dt_s: float, solids: Sequence[Disc]
) -> bool:
    """Whether a step comes no nearer to a solid that it touches."""
    ahead = place_m[0] + velocity_mps[0] * dt_s, place_m[1] + velocity_mps[1] * dt_s
    return not any(gap_m(each, ahead) < min(gap_m(each, place_m), radius_m) for each in solids)
