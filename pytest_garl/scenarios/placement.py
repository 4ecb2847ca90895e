"""From genes to metres: where the marker lies, where objects start and go to."""

from __future__ import annotations

import math

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario

MARKER_SIDE_M = 1.5
MARKER_RADIUS_M = 7.5
TARGET_MARKER_ID = 0
"""Paper, section 4.2: marker of 1.5 m, id 0, up to 7.5 m off the given GPS position."""
MARKER_DICTIONARY = "DICT_5X5_50"


def square_to_disc(x: float, y: float) -> tuple[float, float]:
    """Map [-1, 1]² onto the unit disc, areas in proportion (Shirley and Chiu 1997)."""
    if x == 0 and y == 0:
        return 0.0, 0.0
    if abs(x) > abs(y):
        radius, angle = x, math.pi / 4 * (y / x)
    else:
        radius, angle = y, math.pi / 2 - math.pi / 4 * (x / y)
    return radius * math.cos(angle), radius * math.sin(angle)


def disc_to_square(u: float, v: float) -> tuple[float, float]:
    """Inverse of :func:`square_to_disc`."""
    radius = math.hypot(u, v)
    if radius == 0:
        return 0.0, 0.0
    angle = math.atan2(v, u)
    if angle < -math.pi / 4:
        angle += 2 * math.pi
    quarter = math.pi / 4
    if angle < quarter:
        x, y = radius, angle * radius / quarter
    elif angle < 3 * quarter:
        x, y = -(angle - 2 * quarter) * radius / quarter, radius
    elif angle < 5 * quarter:
        x, y = -radius, -(angle - 4 * quarter) * radius / quarter
    else:
        x, y = (angle - 6 * quarter) * radius / quarter, -radius
    return max(-1.0, min(1.0, x)), max(-1.0, min(1.0, y))


def marker_position_m(scenario: Scenario, map: Map) -> tuple[float, float]:
    """Centre of the marker in the world."""
    u, v = square_to_disc(scenario["marker.x"], scenario["marker.y"])
    gps_x, gps_y = map.gps_position_m
    return gps_x + MARKER_RADIUS_M * u, gps_y + MARKER_RADIUS_M * v


def told_position_m(scenario: Scenario, map: Map) -> tuple[float, float]:
    """Return the coordinate (x, y) that the mission gives for the marker."""
    gps_x, gps_y = map.gps_position_m
    return gps_x + scenario["told.x_m"], gps_y + scenario["told.y_m"]


def marker_genes(position_m: tuple[float, float], map: Map) -> dict[str, float]:
    """Return the marker genes that put its centre nearest to ``position_m``."""
    u = (position_m[0] - map.gps_position_m[0]) / MARKER_RADIUS_M
    v = (position_m[1] - map.gps_position_m[1]) / MARKER_RADIUS_M
    x, y = disc_to_square(u, v)
    return {"marker.x": x, "marker.y": y}


def object_start_m(scenario: Scenario, map: Map, name: str) -> tuple[float, float]:
    """Return the start of an object: its genes scaled to the map's bounds."""
    return _over_bounds(scenario, map, f"{name}.start")


def object_destination_m(scenario: Scenario, map: Map, name: str) -> tuple[float, float] | None:
    """Return the destination of an object, or None if the genome has no destinations."""
    bound = any(key == f"{name}.destination_x" for key, _ in scenario.genes)
    return _over_bounds(scenario, map, f"{name}.destination") if bound else None


def _over_bounds(scenario: Scenario, map: Map, place: str) -> tuple[float, float]:
    x_min, x_max, y_min, y_max = map.bounds_m
    return (
        x_min + (scenario[f"{place}_x"] + 1) / 2 * (x_max - x_min),
        y_min + (scenario[f"{place}_y"] + 1) / 2 * (y_max - y_min),
    )


def start_genes(name: str, position_m: tuple[float, float], map: Map) -> dict[str, float]:
    """Return the start genes that put an object at ``position_m``, clipped to the bounds."""
    x_min, x_max, y_min, y_max = map.bounds_m
    x = 2 * (position_m[0] - x_min) / (x_max - x_min) - 1
    y = 2 * (position_m[1] - y_min) / (y_max - y_min) - 1
    return {
        f"{name}.start_x": max(-1.0, min(1.0, x)),
        f"{name}.start_y": max(-1.0, min(1.0, y)),
    }


def object_speed_mps(scenario: Scenario, map: Map, name: str) -> float:
    """Return the largest speed of an object: its velocity gene times its type's top speed."""
    kind = dict(map.present_objects)[name]
    return scenario[f"{name}.velocity"] * OBJECT_TYPES[kind].top_speed_mps
