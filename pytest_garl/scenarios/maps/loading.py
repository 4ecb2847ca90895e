"""Maps by name: those of the package, and a project's own; a map's file is read strictly."""

from __future__ import annotations

import functools
import hashlib
import inspect
import math
from collections.abc import Sequence
from pathlib import Path
from typing import cast, get_args

from pytest_garl.errors import ScenarioError
from pytest_garl.files.user_files import Table, parse_table, read_text
from pytest_garl.messages import listed, printable, shown
from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.maps.map import Ground, Layer, LayerKind, Map, Texture
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.static_bodies import STATIC_BODIES
from pytest_garl.scenarios.task import read_marker_spec

_GPS_DISC_M = 7.5
LARGEST_AREA_M2 = 10_000.0
"""The ground's picture takes some 25 kB a square metre while it is painted, its margin included:
about half a gigabyte for a map of this size."""
_FAR_M = 300.0
"""No coordinate is larger.  Single precision, in which the camera and the physics compute, is
exact to a few hundredths of a millimetre there."""
_LONGEST_NAME = 50
"""It begins the names of cases and of recorded flights, which may not exceed 255 bytes."""
_MOST_LAYERS = 200
_MOST_POINTS = 1000
_MOST_BODIES = 200
_MOST_BRANCHES = 50
_MOST_OBJECTS = 50
"""Of a kind: ten times the shipped maps, twice.  Each is five genes and a body of the physics."""
_LARGEST_MARKER_ID = 49
"""The last one of the dictionary DICT_5X5_50."""
_FULL_TURN_DEG = 360.0
_POINTS = {"rectangle": (2, 2), "line": (2, _MOST_POINTS), "polygon": (3, _MOST_POINTS)}
"""Smallest and largest number of points of a kind of layer; the others have one."""


def map_names(search_path: Sequence[Path] = ()) -> tuple[str, ...]:
    """Names of all maps that can be found: the package's and the user's."""
    return tuple(
        sorted({file.stem for folder in _folders(search_path) for file in _maps_in(folder)})
    )


def load_map(name: str, search_path: Sequence[Path] = ()) -> Map:
    """Return the map ``<name>.toml`` from the search path, or else from the package.

    Raises ScenarioError for an unknown name or a broken file; the message names file and
    key.
    """
    for folder in _folders(search_path):
        file = folder / f"{name}.toml"
        if file in _maps_in(folder):
            modified_ns = _modified_ns(file)
            return _read(file, modified_ns)
    raise ScenarioError(
        f"unknown map {shown(name)}; expected one of {listed(map_names(search_path))}. "
        "A map of your own is a file scenarios/maps/<name>.toml"
    )


def _modified_ns(file: Path) -> int:
    try:
        return file.stat().st_mtime_ns
    except OSError as error:
        # A link whose target is missing, or a link to itself.
        raise ScenarioError(f"{file}: cannot be read: {error.strerror}") from error


def _folders(search_path: Sequence[Path]) -> tuple[Path, ...]:
    return (*search_path, Path(__file__).parent)


def _maps_in(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(folder.glob("*.toml"))) if folder.is_dir() else ()


@functools.lru_cache(maxsize=64)
def _read(file: Path, modified_ns: int) -> Map:
    """Read a file; the cache reads it again if its modification time has changed."""
    del modified_ns
    _check_name(file)
    text = read_text(file)
    top = parse_table(text, str(file))
    top.refuse_unknown(
        {
            "title",
            "bounds_m",
            "gps_position_m",
            "uav_start_m",
            "ground",
            "layers",
            "bodies",
            "objects",
            "marker",
        }
    )
    x_min, x_max, y_min, y_max = _bounds(top)
    gps_x, gps_y = top.numbers("gps_position_m", 2, (0.0, 0.0))
    start_x, start_y, start_z = top.numbers("uav_start_m", 3)
    if min(gps_x - x_min, x_max - gps_x, gps_y - y_min, y_max - gps_y) < _GPS_DISC_M:
        raise top.error(
            "bounds_m", f"the disc of {_GPS_DISC_M} m about the GPS coordinate sticks out"
        )
    if not (x_min <= start_x <= x_max and y_min <= start_y <= y_max and start_z == 0):
        raise top.error("uav_start_m", "expected a place on the ground (z = 0) inside the bounds")
    bodies = _bodies(top)
    return Map(
        name=file.stem,
        title=top.string("title", file.stem),
        bounds_m=(x_min, x_max, y_min, y_max),
        gps_position_m=(gps_x, gps_y),
        uav_start_m=(start_x, start_y, start_z),
        ground=_ground(top),
        bodies=bodies,
        objects=_objects(top),
        marker=read_marker_spec(top),
        sha256=hashlib.sha256(text.encode()).hexdigest(),
    )


def _check_name(file: Path) -> None:
    """Refuse names that cannot stand in a patch, a test's id, a file's name or a line."""
    if len(file.stem) > _LONGEST_NAME:
        raise ScenarioError(
            f"{file.parent}: the name of the map {shown(file.stem)} has {len(file.stem)} "
            f"characters, expected at most {_LONGEST_NAME}; rename the file"
        )
    if not file.stem.isprintable():
        raise ScenarioError(
            f"{printable(str(file), keep='')}: the name of a map holds characters that cannot be "
            "seen, expected none; rename the file"
        )


def _bounds(top: Table) -> tuple[float, float, float, float]:
    x_min, x_max, y_min, y_max = top.numbers("bounds_m", 4, high=_FAR_M)
    area = (x_max - x_min) * (y_max - y_min)
    if x_max > x_min and y_max > y_min and area > LARGEST_AREA_M2:
        raise top.error(
            "bounds_m",
            f"found {area:g} square metres, expected at most {LARGEST_AREA_M2:g}: the picture of "
            "the ground would not fit into the memory",
        )
    return x_min, x_max, y_min, y_max


def _ground(top: Table) -> Ground:
    ground = top.table("ground")
    ground.refuse_unknown({"texture", "seed", "colour"})
    texture = ground.string("texture", allowed=get_args(Texture))
    return Ground(
        texture=cast(Texture, texture),
        texture_seed=ground.integer("seed"),
        colour=ground.colour("colour"),
        layers=tuple(_layer(layer) for layer in top.tables("layers", most=_MOST_LAYERS)),
    )


def _layer(table: Table) -> Layer:
    table.refuse_unknown(
        {
            "kind",
            "points_m",
            "colour",
            "size_m",
            "width_m",
            "angles_deg",
            "yaw_deg",
            "marker_id",
            "name",
        }
    )
    kind = table.string("kind", allowed=get_args(LayerKind))
    start, end = table.numbers("angles_deg", 2, (0.0, 0.0), high=_FULL_TURN_DEG)
    low, high = _POINTS.get(kind, (1, 1))
    marker_id = (
        table.integer("marker_id", low=1, high=_LARGEST_MARKER_ID) if kind == "marker" else -1
    )
    return Layer(
        kind=cast(LayerKind, kind),
        points_m=table.points("points_m", low, high, _FAR_M),
        colour=table.colour("colour", (255, 255, 255)),
        # A negative zero is no spread that the generator of random numbers takes.
        size_m=abs(table.number("size_m", 0.0, low=0.0, high=_FAR_M)),
        width_m=abs(table.number("width_m", 0.0, low=0.0, high=_FAR_M)),
        angles_rad=(math.radians(start), math.radians(end)),
        yaw_rad=_yaw(table),
        marker_id=marker_id,
        name=table.string("name", f"marker-{marker_id}" if kind == "marker" else kind),
    )


def _yaw(table: Table) -> float:
    return math.radians(table.number("yaw_deg", 0.0, low=-_FULL_TURN_DEG, high=_FULL_TURN_DEG))


def _bodies(top: Table) -> tuple[Body, ...]:
    counts: dict[str, int] = {}
    bodies = []
    for table in top.tables("bodies", most=_MOST_BODIES):
        kind = table.string("kind", allowed=STATIC_BODIES)
        build = STATIC_BODIES[kind]
        arguments = set(inspect.signature(build).parameters)
        table.refuse_unknown({"kind", "position_m", "yaw_deg"} | arguments)
        values = {
            key: table.integer(key, low=1, high=_MOST_BRANCHES)
            if key == "branches"
            else table.number(key, low=0.01, high=100.0)
            for key in table.values
            if key in arguments
        }
        counts[kind] = counts.get(kind, 0) + 1
        x, y = table.numbers("position_m", 2, high=_FAR_M)
        bodies.append(
            Body(
                name=f"{kind}-{counts[kind]}",
                kind=kind,
                parts=build(**values),
                position_m=(x, y, 0.0),
                yaw_rad=_yaw(table),
            )
        )
    return tuple(bodies)


def _objects(top: Table) -> tuple[tuple[str, int], ...]:
    objects = top.table("objects")
    objects.refuse_unknown(OBJECT_TYPES)
    return tuple((kind, objects.integer(kind, high=_MOST_OBJECTS)) for kind in objects.values)
