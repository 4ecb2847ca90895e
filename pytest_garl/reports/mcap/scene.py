"""The topics ``/scene`` and ``/map``: bodies and marker as primitives, the ground from above."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np
from foxglove.messages import (
    CubePrimitive,
    CylinderPrimitive,
    Grid,
    LinePrimitive,
    LinePrimitiveLineType,
    PackedElementField,
    PackedElementFieldNumericType,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    TextPrimitive,
    TriangleListPrimitive,
    Vector2,
)

from pytest_garl.flight.flight import Flight, ObjectRecord
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M
from pytest_garl.messages import shortened
from pytest_garl.reports.film import drawing
from pytest_garl.reports.film.map_pane import MARGIN_M, ground_from_above
from pytest_garl.reports.html.flight_view import UAV_RADIUS_M, UNKNOWN_SIZE_M
from pytest_garl.reports.mcap.export import Place
from pytest_garl.reports.mcap.values import (
    UAV_FRAME,
    WORLD,
    Logged,
    colour,
    point,
    pose,
    stamp,
    vector,
)
from pytest_garl.scenarios.bodies import Body, Part, quaternion_of, rotate
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Pad, PlacedMarker, turned_about
from pytest_garl.simulation.camera.canvas import BLACK_LEVEL, WHITE_LEVEL
from pytest_garl.simulation.camera.ground import paint_ground
from pytest_garl.simulation.camera.ground_cover import cover_shift
from pytest_garl.simulation.camera.marker_patch import modules
from pytest_garl.simulation.camera.true_camera import product
from pytest_garl.simulation.camera.weather import conditions_of
from pytest_garl.simulation.randomness import generator

SCENE, MAP = "/scene", "/map"
CELL_M = 0.1
"""Side of a cell of the map's picture: the marker's modules of 0.21 m are seen, and a map of 40 m
takes some 500 kB before compression."""
_LAID_M = 0.01
"""Height of the marker above the ground, so that a viewer does not mix both."""
_LABEL_PX, _LABEL_ABOVE_M = 14.0, 0.5


def scene(flight: Flight, place: Place | None) -> Iterator[Logged]:
    """Yield all bodies at the start; objects and UAV stay at the origin of their own frames."""
    entities = [_uav(), *(_object(item) for item in flight.objects)]
    if place is None:
        entities.append(_marker_place(flight))
    else:
        entities += [_static(body) for body in place.placed.map.bodies]
        entities += _board(place.placed.pad)
        entities.append(_bounds(place.placed.map))
    entities += [_decoy(number, *decoy) for number, decoy in enumerate(flight.decoys, start=1)]
    yield Logged(time_ns=0, topic=SCENE, message=SceneUpdate(entities=entities))


def ground(place: Place) -> Iterator[Logged]:
    """Yield the ground as it was painted for the flight, as a grid of colours, once."""
    placed = place.placed
    x_min, x_max, y_min, y_max = placed.map.bounds_m
    left, low = x_min - MARGIN_M, y_min - MARGIN_M
    columns = math.ceil((x_max + MARGIN_M - left) / CELL_M)
    rows = math.ceil((y_max + MARGIN_M - low) / CELL_M)
    shift = cover_shift(generator(placed.scenario.seed, "sensor"))
    conditions = conditions_of(placed.scenario)
    wide = paint_ground(placed.map, conditions, shift, placed.pad).wide
    origin_px = -left / CELL_M - 0.5, rows + low / CELL_M - 0.5
    picture = ground_from_above(wide, origin_px, 1 / CELL_M, (columns, rows))
    # Rows of a grid go north, those of a picture south.
    cells = np.full((rows, columns, 4), 255, np.uint8)
    cells[:, :, :3] = picture[::-1]
    fields = [
        PackedElementField(name=name, offset=offset, type=PackedElementFieldNumericType.Uint8)
        for offset, name in enumerate(("red", "green", "blue", "alpha"))
    ]
    message = Grid(
        timestamp=stamp(0),
        frame_id=WORLD,
        pose=pose((left, low, -_LAID_M)),
        column_count=columns,
        cell_size=Vector2(x=CELL_M, y=CELL_M),
        row_stride=columns * 4,
        cell_stride=4,
        fields=fields,
        data=cells.tobytes(),
    )
    yield Logged(time_ns=0, topic=MAP, message=message)


def _entity(name: str, parts: Sequence[Part], frame: str) -> SceneEntity:
    """Return parts in the frame of their body, which moves with it."""
    cubes, cylinders, spheres = [], [], []
    for part in parts:
        where, size, rgb = (
            pose(part.position_m, part.rotation),
            vector(part.size_m),
            colour(part.colour),
        )
        if part.shape == "box":
            cubes.append(CubePrimitive(pose=where, size=size, color=rgb))
        elif part.shape == "cylinder":
            cylinders.append(
                CylinderPrimitive(pose=where, size=size, bottom_scale=1.0, top_scale=1.0, color=rgb)
            )
        else:
            spheres.append(SpherePrimitive(pose=where, size=size, color=rgb))
    return SceneEntity(
        timestamp=stamp(0),
        frame_id=frame,
        id=name,
        frame_locked=True,
        cubes=cubes,
        cylinders=cylinders,
        spheres=spheres,
    )


def _static(body: Body) -> SceneEntity:
    """Return a body of the map in the world."""
    about_z = quaternion_of(yaw_rad=body.yaw_rad)
    parts = []
    for part in body.parts:
        x, y, z = rotate(about_z, part.position_m)
        x0, y0, z0 = body.position_m
        parts.append(
            dataclasses.replace(
                part,
                position_m=(x0 + x, y0 + y, z0 + z),
                rotation=product(about_z, part.rotation),
            )
        )
    return _entity(body.name, parts, WORLD)


def _object(item: ObjectRecord) -> SceneEntity:
    """Return an object by its type; one of the user's own simulator is an upright cylinder."""
    kind = OBJECT_TYPES.get(item.type)
    if kind is not None:
        return _entity(item.name, kind.parts, item.name)
    radius_m, height_m, low_m = UNKNOWN_SIZE_M
    return _entity(
        item.name,
        [
            Part(
                shape="cylinder",
                size_m=(2 * radius_m, 2 * radius_m, height_m),
                position_m=(0.0, 0.0, low_m + height_m / 2),
            )
        ],
        item.name,
    )


def _uav() -> SceneEntity:
    """Return a body with four rotors, 1 m from tip to tip, whose nose is marked."""
    reach, rotor = 0.65 * UAV_RADIUS_M / math.sqrt(2), 0.7 * UAV_RADIUS_M
    rotors = [
        Part(
            shape="cylinder",
            size_m=(rotor, rotor, 0.02),
            position_m=(x * reach, y * reach, 0.05),
            colour=drawing.FAINT,
        )
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    body = Part(
        shape="box",
        size_m=(0.3, 0.3, 0.1),
        position_m=(0.0, 0.0, 0.0),
        colour=drawing.UAV,
    )
    nose = Part(
        shape="box", size_m=(0.2, 0.06, 0.04), position_m=(0.25, 0.0, 0.0), colour=drawing.HIT
    )
    legs = [
        Part(
            shape="cylinder",
            size_m=(0.03, 0.03, BODY_ABOVE_FEET_M),
            position_m=(x * 0.12, y * 0.12, -BODY_ABOVE_FEET_M / 2),
            colour=drawing.INK,
        )
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    return _entity("uav", [body, nose, *rotors, *legs], UAV_FRAME)


def _board(pad: Pad) -> list[SceneEntity]:
    """Return each marker of the board, module by module, with the white margin around it."""
    return [_marker(marker, index) for index, marker in enumerate(pad.markers)]


def _marker(marker: PlacedMarker, index: int) -> SceneEntity:
    white = modules(marker.id, marker.dictionary)
    count = len(white)
    cell = marker.side_m / (count - 2)
    lines = np.arange(count + 1) * cell - count * cell / 2
    # Nested markers lie over the main one.
    height = _LAID_M * (1 + index)
    points, colours = [], []
    for row in range(count):
        for column in range(count):
            west, east, north, south = (
                lines[column],
                lines[column + 1],
                -lines[row],
                -lines[row + 1],
            )
            corners = ((west, north), (east, north), (east, south), (west, south))
            placed = [
                (*turned_about(marker.place_m, (float(x), float(y)), marker.yaw_rad), height)
                for x, y in corners
            ]
            grey = WHITE_LEVEL if white[row, column] else BLACK_LEVEL
            for corner in (0, 3, 2, 0, 2, 1):
                points.append(point(placed[corner]))
                colours.append(colour((grey,) * 3))
    return SceneEntity(
        timestamp=stamp(0),
        frame_id=WORLD,
        id=f"marker {marker.id}",
        frame_locked=True,
        triangles=[
            TriangleListPrimitive(pose=pose((0.0, 0.0, 0.0)), points=points, colors=colours)
        ],
    )


def _marker_place(flight: Flight) -> SceneEntity:
    """Return a disc where the marker lies, if its board is not known."""
    x, y = flight.marker_position_m
    disc = Part(
        shape="cylinder",
        size_m=(1.0, 1.0, _LAID_M),
        position_m=(x, y, _LAID_M / 2),
        colour=drawing.MARKER,
    )
    return _entity("marker", [disc], WORLD)


def _bounds(map: Map) -> SceneEntity:
    x_min, x_max, y_min, y_max = map.bounds_m
    corners = ((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
    line = LinePrimitive(
        type=LinePrimitiveLineType.LineLoop,
        pose=pose((0.0, 0.0, 0.0)),
        thickness=0.05,
        points=[point((x, y, _LAID_M)) for x, y in corners],
        color=colour(drawing.FAINT),
    )
    return SceneEntity(
        timestamp=stamp(0), frame_id=WORLD, id="bounds", frame_locked=True, lines=[line]
    )


def _decoy(number: int, name: str, x: float, y: float) -> SceneEntity:
    text = TextPrimitive(
        pose=pose((x, y, _LABEL_ABOVE_M)),
        billboard=True,
        font_size=_LABEL_PX,
        scale_invariant=True,
        color=colour(drawing.INK),
        text=shortened(name),
    )
    return SceneEntity(
        timestamp=stamp(0), frame_id=WORLD, id=f"decoy {number}", frame_locked=True, texts=[text]
    )
