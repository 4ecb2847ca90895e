"""Ground truth about a touchdown: what lies under the UAV."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.maps.map import Layer
from pytest_garl.scenarios.placed import PlacedMarker
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.ground import shadow_of
from pytest_garl.simulation.camera.meshes import mesh_of, placed_hulls
from pytest_garl.simulation.camera.solids import sun_shines
from pytest_garl.simulation.camera.weather import conditions_of

REACH_M = 0.5
"""Half the span of the UAV: what is nearer to its middle than this lies under it."""

Place = tuple[float, float]


def what_lies_under(
    place: Place,
    marker: PlacedMarker,
    layers: Iterable[Layer],
    bodies: Iterable[Body],
    scenario: Scenario,
) -> str:
    """Return "marker", the name of a decoy, "shadow", "line" or "nothing" for a place (x, y).

    The nearest marker or decoy within reach counts before everything else, then the nearest shadow
    of a body, or whatever is painted on the ground.  Worn patches and roots are nothing that could
    be taken for a marker.
    """
    layers = tuple(layers)
    targets = [(_square_distance_m(place, marker.place_m, marker.side_m, marker.yaw_rad), "marker")]
    targets += [
        (_square_distance_m(place, layer.points_m[0], layer.size_m, layer.yaw_rad), layer.name)
        for layer in layers
        if layer.kind == "marker"
    ]
    shadow_m = min(_shadow_distances_m(place, bodies, scenario), default=math.inf)
    line_m = min((_painted_distance_m(place, layer) for layer in layers), default=math.inf)
    for features in (targets, [(shadow_m, "shadow"), (line_m, "line")]):
        distance_m, name = min(features, key=lambda feature: feature[0])
        if distance_m <= REACH_M:
            return name
    return "nothing"


def _square_distance_m(place: Place, centre: Place, side_m: float, yaw_rad: float) -> float:
    """Return the distance from a square, 0 inside."""
    dx, dy = place[0] - centre[0], place[1] - centre[1]
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    across, along = abs(cos * dx + sin * dy), abs(cos * dy - sin * dx)
    return math.hypot(max(0.0, across - side_m / 2), max(0.0, along - side_m / 2))


def _shadow_distances_m(
    place: Place, bodies: Iterable[Body], scenario: Scenario
) -> Iterator[float]:
    conditions = conditions_of(scenario)
    if not sun_shines(conditions):
        return
    for body in bodies:
        for hull in placed_hulls(mesh_of(body.parts), body.position_m, body.yaw_rad):
            outline = cv2.convexHull(shadow_of(hull, conditions.sun).astype(np.float32))
            yield _polygon_distance_m(place, outline.reshape(-1, 2).astype(np.float64))


def _polygon_distance_m(place: Place, corners: NDArray[np.float64]) -> float:
    inside = cv2.pointPolygonTest(corners.astype(np.float32), place, measureDist=True)
    return max(0.0, -float(inside))


def _painted_distance_m(place: Place, layer: Layer) -> float:
    """Return the distance from what a layer paints; infinite for worn patches, roots, markers."""
    points = layer.points_m
    if layer.kind == "rectangle":
        (x0, y0), (x1, y1) = points
        dx, dy = abs(place[0] - (x0 + x1) / 2), abs(place[1] - (y0 + y1) / 2)
        return math.hypot(max(0.0, dx - abs(x1 - x0) / 2), max(0.0, dy - abs(y1 - y0) / 2))
    if layer.kind == "polygon":
        return _polygon_distance_m(place, np.array(points))
    if layer.kind == "line":
        ways = (_segment_distance_m(place, *ends) for ends in itertools.pairwise(points))
        return max(0.0, min(ways) - layer.size_m / 2)
    if layer.kind == "circle":
        radius_m = math.dist(place, points[0])
        outside_m = radius_m - layer.size_m
        edge_m = abs(outside_m) if layer.width_m > 0 else outside_m
        return max(0.0, edge_m - layer.width_m / 2)
    if layer.kind == "arc":
        return _arc_distance_m(place, layer)
    return math.inf


def _arc_distance_m(place: Place, layer: Layer) -> float:
    """Return the distance from a stroke along an arc, or from the piece that its chord cuts off."""
    (x, y), (start, end) = layer.points_m[0], layer.angles_rad
    angles = np.linspace(start, end, 64)
    ring = np.column_stack([x + layer.size_m * np.cos(angles), y + layer.size_m * np.sin(angles)])
    if layer.width_m <= 0:
        return _polygon_distance_m(place, ring)
    corners = [(float(a), float(b)) for a, b in ring]
    ways = (_segment_distance_m(place, *ends) for ends in itertools.pairwise(corners))
    return max(0.0, min(ways) - layer.width_m / 2)


def _segment_distance_m(place: Place, start: Place, end: Place) -> float:
    dx, dy = end[0] - start[0], end[1] - start[1]
    px, py = place[0] - start[0], place[1] - start[1]
    length2 = dx * dx + dy * dy
    share = min(1.0, max(0.0, (px * dx + py * dy) / length2)) if length2 > 0 else 0.0
    return math.hypot(px - share * dx, py - share * dy)
