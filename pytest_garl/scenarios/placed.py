"""From genes to metres and back: where everything of a scenario is on its map."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import DICTIONARIES, PAPER_MARKER, MarkerSpec
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.groups import DECOY_KINDS, DECOYS
from pytest_garl.scenarios.maps.map import Layer, Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES, ObjectType
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import Story, children_in, story_of

MARKER_RADIUS_M = 7.5
TARGET_MARKER_ID = PAPER_MARKER.id
"""Paper, section 4.2: marker of 1.5 m, id 0, up to 7.5 m off the given GPS position."""
MARKER_DICTIONARY = MAP_DICTIONARY = PAPER_MARKER.dictionary
"""Also the dictionary of the other markers that are painted on the ground of maps."""
UAV_CLEARANCE_M = 2.0
"""Nothing is nearer to the UAV when a flight begins."""
_RING_M, _DIRECTIONS = 0.5, 32
_FARTHEST_M = 50.0
Place = tuple[float, float]


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


def marker_genes(position_m: tuple[float, float], map: Map) -> dict[str, float]:
    """Return the marker genes that put its centre nearest to ``position_m``."""
    u = (position_m[0] - map.gps_position_m[0]) / MARKER_RADIUS_M
    v = (position_m[1] - map.gps_position_m[1]) / MARKER_RADIUS_M
    x, y = disc_to_square(u, v)
    return {"marker.x": x, "marker.y": y}


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


@dataclass(frozen=True)
class PlacedNpc:
    """One NPC of a scenario: its type, its story, and its genes in metres."""

    scenario: Scenario
    map: Map
    name: str

    @cached_property
    def type(self) -> ObjectType:
        """Its type in the scenario, where a person may be a child."""
        return OBJECT_TYPES[dict(self.map.present_objects)[self.name]]

    @cached_property
    def story(self) -> Story | None:
        """Its story, None if the scenario has none for it."""
        return story_of(self.scenario, self.name)

    @cached_property
    def start_m(self) -> Place:
        """Its start: its genes scaled to the map's bounds."""
        return self._over_bounds("start")

    @cached_property
    def destination_m(self) -> Place | None:
        """Its destination, None if the genome has no destinations."""
        key = f"{self.name}.destination_x"
        bound = any(each == key for each, _ in self.scenario.genes)
        return self._over_bounds("destination") if bound else None

    @cached_property
    def speed_mps(self) -> float:
        """Its largest speed: what its velocity gene means for its type."""
        return self.type.speed_mps(self.scenario[f"{self.name}.velocity"])

    @cached_property
    def height_m(self) -> float:
        """The height of its frame above the ground; what never moves sits there."""
        if not self.type.flies or self.speed_mps == 0:
            return self.type.sitting_m
        return self.scenario.get(f"{self.name}.height_m", self.type.altitude_m)

    def _over_bounds(self, end: str) -> Place:
        x_min, x_max, y_min, y_max = self.map.bounds_m
        x, y = (self.scenario[f"{self.name}.{end}_{axis}"] for axis in "xy")
        return x_min + (x + 1) / 2 * (x_max - x_min), y_min + (y + 1) / 2 * (y_max - y_min)


@dataclass(frozen=True)
class Placed:
    """The places of a scenario, each computed once, when somebody asks for it first.

    ``whole_map`` is its map, with or without the objects that the scenario removes.
    """

    scenario: Scenario
    whole_map: Map
    _npcs: dict[str, PlacedNpc] = field(default_factory=dict, init=False, repr=False, compare=False)

    @cached_property
    def map(self) -> Map:
        """The map with the objects that are there in the scenario."""
        names = (name for name, _ in self.whole_map.all_objects)
        place = self.whole_map.without(self.scenario.removed_objects)
        return dataclasses.replace(place, children=children_in(self.scenario, names))

    @cached_property
    def marker_m(self) -> Place:
        """The centre of the marker in the world."""
        u, v = square_to_disc(self.scenario["marker.x"], self.scenario["marker.y"])
        gps_x, gps_y = self.whole_map.gps_position_m
        return gps_x + MARKER_RADIUS_M * u, gps_y + MARKER_RADIUS_M * v

    @cached_property
    def pad(self) -> Pad:
        """The board with the scenario's marker."""
        return Pad(
            spec=self.scenario.task.marker,
            place_m=self.marker_m,
            yaw_rad=math.radians(self.scenario["pad.yaw_deg"]),
            worn_share=self.scenario["pad.worn_percent"] / 100,
            seed=self.scenario.seed,
            decoys=self.decoys,
        )

    @cached_property
    def decoys(self) -> tuple[Decoy, ...]:
        """The decoys, each as large as the marker."""
        kinds = {group.name: _decoy_kind(self.scenario, group.name) for group in DECOYS}
        return tuple(self._decoy(name, kind) for name, kind in kinds.items() if kind != "none")

    def _decoy(self, name: str, kind: str) -> Decoy:
        scenario, spec = self.scenario, self.scenario.task.marker
        east, north = self.whole_map.gps_position_m
        return Decoy(
            name=name,
            kind=kind,
            place_m=(east + scenario[f"{name}.x_m"], north + scenario[f"{name}.y_m"]),
            yaw_rad=math.radians(scenario[f"{name}.yaw_deg"]),
            side_m=spec.side_m,
            dictionary=spec.dictionary,
            id=_other_id(spec) if kind == "other-id" else spec.id,
        )

    @cached_property
    def layers(self) -> tuple[Layer, ...]:
        """What is painted on the ground, and the decoys that lie there."""
        return (*self.whole_map.ground.layers, *(each.layer for each in self.decoys))

    @cached_property
    def told_m(self) -> Place:
        """The coordinate (x, y) that the mission gives for the marker."""
        surveyed = self.scenario["told.surveyed"] >= 0.5
        x, y = self.marker_m if surveyed else self.whole_map.gps_position_m
        towards = math.radians(self.scenario["told.towards_deg"])
        error_m = self.scenario["told.error_m"]
        return x + error_m * math.cos(towards), y + error_m * math.sin(towards)

    @cached_property
    def start_m(self) -> tuple[float, float, float]:
        """Where the UAV is at the start, (x, y, height of its feet or of a hovering body).

        A hover begins at the nearest place that is 2 m clear of every static body, because an error
        of the mission's coordinate may put the start into a tree.  Raises ScenarioError if none
        is clear.
        """
        start = self.scenario.task.start
        if not start.hovers:
            return self.whole_map.uav_start_m
        x, y = self.told_m
        for place in _places_around((x + start.offset_m[0], y + start.offset_m[1])):
            if _is_clear((*place, start.height_m), self.whole_map):
                return *place, start.height_m
        raise ScenarioError(
            f"start offset_m = {start.offset_m!r}: no place within {_FARTHEST_M:g} m of it is "
            f"clear of the bodies of the map {self.map.name!r} at a height of {start.height_m:g} m"
        )

    def npc(self, name: str) -> PlacedNpc:
        """Return an NPC that is there in the scenario."""
        if name not in self._npcs:
            self._npcs[name] = PlacedNpc(self.scenario, self.map, name)
        return self._npcs[name]


def _decoy_kind(scenario: Scenario, name: str) -> str:
    return DECOY_KINDS[math.ceil(scenario[f"{name}.kind"])]


def _other_id(spec: MarkerSpec) -> int:
    """Return the next id that is not on the board."""
    size, taken = DICTIONARIES[spec.dictionary].size, {each.id for each in spec.markers}
    ids = ((spec.id + step) % size for step in range(1, size))
    return next(each for each in ids if each not in taken)


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
