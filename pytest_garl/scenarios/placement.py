"""From genes to metres: where the marker lies, where objects start and go to."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from pytest_garl.fiducial import DICTIONARIES, PAPER_MARKER, MarkerSpec
from pytest_garl.scenarios.groups import DECOY_KINDS, DECOYS
from pytest_garl.scenarios.maps.map import Layer, Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES, ObjectType
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import children_in

MARKER_RADIUS_M = 7.5
TARGET_MARKER_ID = PAPER_MARKER.id
"""Paper, section 4.2: marker of 1.5 m, id 0, up to 7.5 m off the given GPS position."""
MARKER_DICTIONARY = MAP_DICTIONARY = PAPER_MARKER.dictionary
"""Also the dictionary of the other markers that are painted on the ground of maps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedMarker:
    """One marker of a board in the world."""

    dictionary: str
    id: int
    side_m: float
    place_m: tuple[float, float]
    yaw_rad: float

    @property
    def outline_m(self) -> tuple[tuple[float, float], ...]:
        """Corners of the black border: the marker's top left, top right and so on, clockwise."""
        half = self.side_m / 2
        corners = ((-half, half), (half, half), (half, -half), (-half, -half))
        return tuple(turned_about(self.place_m, corner, self.yaw_rad) for corner in corners)


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoy:
    """A thing on the ground that could be taken for the marker; ``name`` is that of its group."""

    name: str
    kind: str
    place_m: tuple[float, float]
    yaw_rad: float
    side_m: float
    dictionary: str
    id: int

    @property
    def layer(self) -> Layer:
        """Return what it is to verdicts: a square on the ground, named by its kind alone."""
        return Layer(
            kind="marker",
            name=f"decoy-{self.kind}",
            points_m=(self.place_m,),
            size_m=self.side_m,
            yaw_rad=self.yaw_rad,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pad:
    """The board with the marker as it lies on the ground; at zero yaw its top is north.

    ``worn_share`` of each marker is worn off in patches, which follow from ``seed``; a tarpaulin
    lies over ``covered_share`` of the main one.  ``decoys`` lie about it.
    """

    spec: MarkerSpec
    place_m: tuple[float, float]
    yaw_rad: float = 0.0
    worn_share: float = 0.0
    seed: int = 0
    covered_share: float = 0.0
    decoys: tuple[Decoy, ...] = ()

    @property
    def markers(self) -> tuple[PlacedMarker, ...]:
        """All markers of the board in the world, the main one first."""
        return tuple(
            PlacedMarker(
                dictionary=self.spec.dictionary,
                id=each.id,
                side_m=each.side_m,
                place_m=turned_about(self.place_m, each.offset_m, self.yaw_rad),
                yaw_rad=self.yaw_rad,
            )
            for each in self.spec.markers
        )

    @property
    def main(self) -> PlacedMarker:
        """The marker that missions name."""
        return self.markers[0]

    @property
    def cover_m(self) -> tuple[tuple[float, float], ...]:
        """Corners of the tarpaulin: across the marker and its margins, from its left side on."""
        half, margin = self.spec.side_m / 2, self.spec.side_m / self.spec.modules
        right = -half + self.covered_share * self.spec.side_m
        high, left = half + margin, -half - margin
        corners = ((left, high), (right, high), (right, -high), (left, -high))
        return tuple(turned_about(self.place_m, corner, self.yaw_rad) for corner in corners)


def turned_about(
    centre: tuple[float, float], offset: tuple[float, float], yaw_rad: float
) -> tuple[float, float]:
    """Return a centre plus an offset that is turned by a yaw."""
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    x, y = offset
    return centre[0] + (cos * x - sin * y), centre[1] + (sin * x + cos * y)


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


def pad_of(scenario: Scenario, map: Map) -> Pad:
    """Return the board with the scenario's marker."""
    return Pad(
        spec=scenario.task.marker,
        place_m=marker_position_m(scenario, map),
        yaw_rad=math.radians(scenario["pad.yaw_deg"]),
        worn_share=scenario["pad.worn_percent"] / 100,
        seed=scenario.seed,
        decoys=decoys_of(scenario, map),
    )


def decoys_of(scenario: Scenario, map: Map) -> tuple[Decoy, ...]:
    """Return the decoys of a scenario, each as large as the marker."""
    spec, (east, north) = scenario.task.marker, map.gps_position_m
    found = []
    for group in DECOYS:
        kind = DECOY_KINDS[math.ceil(scenario[f"{group.name}.kind"])]
        if kind == "none":
            continue
        found.append(
            Decoy(
                name=group.name,
                kind=kind,
                place_m=(
                    east + scenario[f"{group.name}.x_m"],
                    north + scenario[f"{group.name}.y_m"],
                ),
                yaw_rad=math.radians(scenario[f"{group.name}.yaw_deg"]),
                side_m=spec.side_m,
                dictionary=spec.dictionary,
                id=_other_id(spec) if kind == "other-id" else spec.id,
            )
        )
    return tuple(found)


def _other_id(spec: MarkerSpec) -> int:
    """Return the next id that is not on the board."""
    size, taken = DICTIONARIES[spec.dictionary].size, {each.id for each in spec.markers}
    ids = ((spec.id + step) % size for step in range(1, size))
    return next(each for each in ids if each not in taken)


def told_position_m(scenario: Scenario, map: Map) -> tuple[float, float]:
    """Return the coordinate (x, y) that the mission gives for the marker."""
    surveyed = scenario["told.surveyed"] >= 0.5
    x, y = marker_position_m(scenario, map) if surveyed else map.gps_position_m
    error_m, towards = scenario["told.error_m"], math.radians(scenario["told.towards_deg"])
    return x + error_m * math.cos(towards), y + error_m * math.sin(towards)


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
    return place_genes(f"{name}.start", position_m, map)


def place_genes(place: str, position_m: tuple[float, float], map: Map) -> dict[str, float]:
    """Return the genes of an NPC's start or destination, clipped to the map's bounds."""
    x_min, x_max, y_min, y_max = map.bounds_m
    x = 2 * (position_m[0] - x_min) / (x_max - x_min) - 1
    y = 2 * (position_m[1] - y_min) / (y_max - y_min) - 1
    return {
        f"{place}_x": max(-1.0, min(1.0, x)),
        f"{place}_y": max(-1.0, min(1.0, y)),
    }


def object_speed_mps(scenario: Scenario, map: Map, name: str) -> float:
    """Return the largest speed of an object: what its velocity gene means for its type."""
    return object_type(scenario, map, name).speed_mps(scenario[f"{name}.velocity"])


def object_altitude_m(scenario: Scenario, map: Map, name: str) -> float:
    """Return the height of an object's frame above the ground; what never moves sits there."""
    kind = object_type(scenario, map, name)
    if not kind.flies or object_speed_mps(scenario, map, name) == 0:
        return kind.sitting_m
    return scenario.get(f"{name}.height_m", kind.altitude_m)


def object_type(scenario: Scenario, map: Map, name: str) -> ObjectType:
    """Return the type of an object of the map in a scenario."""
    return OBJECT_TYPES[dict(map_in(scenario, map).present_objects)[name]]


def map_in(scenario: Scenario, map: Map) -> Map:
    """Return the map with the objects that are there in a scenario."""
    names = (name for name, _ in map.all_objects)
    place = map.without(scenario.removed_objects)
    return dataclasses.replace(place, children=children_in(scenario, names))
