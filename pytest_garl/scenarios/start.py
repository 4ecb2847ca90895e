"""Where a flight begins: on the ground at home, or hovering near the told coordinate."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placement import told_position_m
from pytest_garl.scenarios.scenario import Scenario

UAV_CLEARANCE_M = 2.0
"""Nothing is nearer to the UAV when a flight begins."""
LOWEST_HOVER_M, HIGHEST_HOVER_M = 2.0, 100.0
"""Heights at which a flight can begin: above a take-off, below what the camera draws."""
_RING_M, _DIRECTIONS = 0.5, 32
_FARTHEST_M = 50.0


def hovers(scenario: Scenario) -> bool:
    """Whether the flight begins in the air."""
    return scenario.task.start.mode == "hover"


def start_m(scenario: Scenario, map: Map) -> tuple[float, float, float]:
    """Return where the UAV is at the start, (x, y, height of its feet or of a hovering body).

    A hover begins at the nearest place that is 2 m clear of every static body, because an error of
    the told coordinate may put the start into a tree.  Raises ScenarioError for a height at which
    no flight can begin.
    """
    if not hovers(scenario):
        return map.uav_start_m
    start = scenario.task.start
    if not LOWEST_HOVER_M <= start.height_m <= HIGHEST_HOVER_M:
        raise ScenarioError(
            f"start height_m = {start.height_m!r}: expected {LOWEST_HOVER_M:g} to "
            f"{HIGHEST_HOVER_M:g} m for a start that hovers"
        )
    told = told_position_m(scenario, map)
    for x, y in _places_around((told[0] + start.offset_m[0], told[1] + start.offset_m[1])):
        if _is_clear((x, y, start.height_m), map):
            return x, y, start.height_m
    raise ScenarioError(
        f"start offset_m = {start.offset_m!r}: no place within {_FARTHEST_M:g} m of it is clear of "
        f"the bodies of the map {map.name!r} at a height of {start.height_m:g} m"
    )


def start_yaw_rad(scenario: Scenario) -> float:
    """Return the UAV's heading at the start."""
    return math.radians(scenario["heading.start_deg"])


def _places_around(middle: tuple[float, float]) -> Iterator[tuple[float, float]]:
    yield middle
    for ring in range(1, round(_FARTHEST_M / _RING_M) + 1):
        for step in range(_DIRECTIONS):
            angle = 2 * math.pi * step / _DIRECTIONS
            dx, dy = ring * _RING_M * math.cos(angle), ring * _RING_M * math.sin(angle)
            yield middle[0] + dx, middle[1] + dy


def _is_clear(place: tuple[float, float, float], map: Map) -> bool:
    x, y, z = place
    for body in map.bodies:
        for disc in discs_of(body):
            beside_m = math.hypot(x - disc.x_m, y - disc.y_m) - disc.radius_m
            apart_m = max(disc.low_m - z, z - disc.high_m)
            if max(beside_m, apart_m) < UAV_CLEARANCE_M:
                return False
    return True
