"""Maps: where a scenario takes place, as data (TOML files)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from pytest_garl.errors import ScenarioError
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.messages import listed
from pytest_garl.scenarios.bodies import Body

LayerKind = Literal["rectangle", "line", "circle", "arc", "polygon", "roots", "patches", "marker"]
Texture = Literal["concrete", "grass", "asphalt", "sand", "soil"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """One thing painted on the ground, in the order of the file.

    ``points_m`` are world (x, y) pairs: opposite corners of a rectangle, the ends (or
    corners) of a line, the centre of a circle, arc or decoy marker, the corners of a
    polygon, the middle of roots or patches.  ``size_m`` is the line's width, the circle's
    or arc's radius, the marker's side, the spread of roots or patches; ``width_m`` the
    stroke of circles and arcs (0: filled); ``angles_rad`` an arc's start and end;
    ``marker_id`` the decoy's id; ``colour`` RGB 0-255.
    """

    kind: LayerKind
    points_m: tuple[tuple[float, float], ...]
    colour: tuple[int, int, int] = (255, 255, 255)
    size_m: float = 0.0
    width_m: float = 0.0
    angles_rad: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    marker_id: int = -1
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """The planar ground: a procedural base texture with its own seed, and the layers over it."""

    texture: Texture
    texture_seed: int
    colour: tuple[int, int, int]
    layers: tuple[Layer, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """One place: ground, static bodies, dynamic objects, bounds, GPS position and start.

    ``bounds_m`` is (x_min, x_max, y_min, y_max); ``objects`` are (type, count) pairs
    of the dynamic objects; ``marker`` is the one to land on unless the test states another;
    ``sha256`` is the hash of the file and part of a run's identity.
    ``removed_objects`` are the names of objects that one scenario leaves out, ``children`` those of
    persons who are children in it; a map file names none.
    """

    name: str
    title: str
    bounds_m: tuple[float, float, float, float]
    gps_position_m: tuple[float, float]
    uav_start_m: tuple[float, float, float]
    ground: Ground
    bodies: tuple[Body, ...]
    objects: tuple[tuple[str, int], ...]
    sha256: str
    marker: MarkerSpec = field(default_factory=MarkerSpec)
    removed_objects: tuple[str, ...] = ()
    children: tuple[str, ...] = ()

    @property
    def all_objects(self) -> tuple[tuple[str, str], ...]:
        """(name, type) of each dynamic object in order, including the removed ones."""
        return tuple(
            (name, "child" if name in self.children else kind)
            for kind, count in self.objects
            for name in (f"{kind}-{index}" for index in range(1, count + 1))
        )

    @property
    def present_objects(self) -> tuple[tuple[str, str], ...]:
        """(name, type) of the objects that are not removed, such as ``("person-1", "person")``."""
        return tuple(pair for pair in self.all_objects if pair[0] not in self.removed_objects)

    def without(self, removed: Iterable[str]) -> Map:
        """Return the map without these objects; raise ScenarioError for unknown ones."""
        names = tuple(sorted(removed))
        known = [name for name, _ in self.all_objects]
        unknown = [name for name in names if name not in known]
        if unknown:
            raise ScenarioError(
                f"map {self.name!r} has no object {listed(unknown)}; it has {listed(known)}"
            )
        return dataclasses.replace(self, removed_objects=names)

    @property
    def diagonal_m(self) -> float:
        """Length of the map's diagonal."""
        x_min, x_max, y_min, y_max = self.bounds_m
        return float(((x_max - x_min) ** 2 + (y_max - y_min) ** 2) ** 0.5)
