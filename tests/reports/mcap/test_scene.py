from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.reports.mcap.export import Place
from pytest_garl.scenarios.bodies import Body, Part
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.meshes import mesh_of, placed_hulls, rotation_matrix
from tests.reports.mcap.conftest import Exported
from tests.support.mcap_files import decoded, needs_extra
from tests.support.recorded_flights import recorded, seen
from tests.support.videos import LAWN, SCENARIO

needs_extra()


def entities(exported: Exported) -> dict[str, Any]:
    ((time_ns, message),) = exported.recording.topics["/scene"]
    assert time_ns == 0
    return {each.id: each for each in message.entities}


def places(primitive: Any) -> NDArray[np.float64]:
    """Return the ends (6, 3) of a primitive's own axes."""
    turn, at, size = primitive.pose.orientation, primitive.pose.position, primitive.size
    half = np.diag([size.x, size.y, size.z]) / 2
    ends = np.concatenate([half, -half]) @ rotation_matrix((turn.x, turn.y, turn.z, turn.w)).T
    return np.asarray(ends + np.array([at.x, at.y, at.z]))


def test_there_is_an_entity_for_each_body_the_marker_and_the_uav(exported: Exported) -> None:
    found = entities(exported)
    names = {body.name for body in LAWN.bodies} | {item.name for item in exported.flight.objects}
    decoys = {f"decoy {index}" for index, _ in enumerate(exported.flight.decoys, start=1)}
    assert set(found) == names | {"uav", "marker 0", "bounds"} | decoys
    frames = {name: each.frame_id for name, each in found.items() if each.frame_id != "world"}
    assert frames == {name: name for name in ("uav", "person-1", "person-2", "dog-1")}
    assert all(each.frame_locked for each in found.values())


def test_an_object_has_the_parts_of_its_type(exported: Exported) -> None:
    dog, parts = entities(exported)["dog-1"], OBJECT_TYPES["dog"].parts
    kinds = {"box": dog.cubes, "cylinder": dog.cylinders}
    for shape, found in kinds.items():
        assert len(found) == sum(part.shape == shape for part in parts)
    assert len(dog.spheres) == sum(part.shape in ("sphere", "ellipsoid") for part in parts)
    (first, *_) = [part for part in parts if part.shape == "cylinder"]
    shown = dog.cylinders[0]
    assert (shown.size.x, shown.size.y, shown.size.z) == first.size_m
    assert (shown.bottom_scale, shown.top_scale) == (1.0, 1.0)
    assert shown.color.r == pytest.approx(first.colour[0] / 255)


def test_a_turned_body_lies_where_the_camera_draws_it() -> None:
    from pytest_garl.reports.mcap.scene import scene

    part = Part(
        shape="box",
        size_m=(2.0, 1.0, 0.5),
        position_m=(1.0, 0.5, 0.75),
        rotation=(0.1, 0.2, 0.3, (1 - 0.14) ** 0.5),
    )
    body = Body(name="box", kind="box", parts=(part,), position_m=(3.0, -2.0, 0.0), yaw_rad=0.7)
    map = dataclasses.replace(Placed(SCENARIO, LAWN).map, bodies=(body,))
    flight = dataclasses.replace(
        recorded(steps=seen(())), marker_position_m=Placed(SCENARIO, map).pad.place_m
    )
    (logged,) = scene(flight, Place(placed=Placed(SCENARIO, map), camera=None))
    update = decoded(logged.message)
    (cube,) = next(each for each in update.entities if each.id == "box").cubes
    (hull,) = placed_hulls(mesh_of(body.parts), body.position_m, body.yaw_rad)
    # The middles of a box's sides are the means of four of its corners each.
    middles = [hull[[0, 1, 2, 3]], hull[[4, 5, 6, 7]], hull[[0, 1, 4, 5]], hull[[2, 3, 6, 7]]]
    middles += [hull[::2], hull[1::2]]
    wanted = np.array([corners.mean(axis=0) for corners in middles])
    gaps = np.linalg.norm(places(cube)[:, None] - wanted[None], axis=2)
    assert gaps.min(axis=1).max() < 1e-5


def test_the_marker_is_drawn_module_by_module(exported: Exported) -> None:
    (triangles,) = entities(exported)["marker 0"].triangles
    marker = Placed(SCENARIO, LAWN).pad.main
    points = np.array([(each.x, each.y) for each in triangles.points]).reshape(-1, 6, 2)
    white = np.array([each.r > 0.5 for each in triangles.colors]).reshape(-1, 6)[:, 0]
    assert len(points) == 9 * 9
    middles = points.mean(axis=1)
    # The margin is white, the border black; both are rings.
    off = np.abs(middles - marker.place_m).max(axis=1) / (marker.side_m / 7)
    ring = np.round(off).astype(int)
    assert white[ring == 4].all()
    assert not white[ring == 3].any()
    assert 0 < white[ring < 3].sum() < 25
    for corner in marker.outline_m:
        assert np.linalg.norm(points.reshape(-1, 2) - corner, axis=1).min() < 1e-6


def test_the_map_is_the_ground_from_above(exported: Exported) -> None:
    ((_, grid),) = exported.recording.topics["/map"]
    rows = len(grid.data) // grid.row_stride
    cells = np.frombuffer(grid.data, np.uint8).reshape(rows, grid.column_count, 4)
    x_min, x_max, y_min, y_max = LAWN.bounds_m
    cell_m = grid.cell_size.x
    assert (rows, grid.column_count) == (
        round((y_max - y_min + 4) / cell_m),
        round((x_max - x_min + 4) / cell_m),
    )
    assert [each.name for each in grid.fields] == ["red", "green", "blue", "alpha"]
    marker = Placed(SCENARIO, LAWN).pad.main

    def colours(dx: float, dy: float) -> NDArray[np.uint8]:
        """Return the cell at a place beside the marker's centre, whose yaw is nought."""
        x, y = marker.place_m[0] + dx, marker.place_m[1] + dy
        column = int((x - grid.pose.position.x) / cell_m)
        row = int((y - grid.pose.position.y) / cell_m)
        return cells[row, column, :3]

    assert marker.yaw_rad == 0
    module = marker.side_m / 7
    for side in (-1, 1):
        assert colours(side * 4 * module, 0).min() > 120
        assert colours(0, side * 4 * module).min() > 120
        assert colours(side * 3 * module, 0).max() < 90
        assert colours(0, side * 3 * module).max() < 90
