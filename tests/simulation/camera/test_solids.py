"""Bodies in the frame lie where the physics has them."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
import pytest

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.simulation.camera.meshes import mesh_of, placed
from pytest_garl.simulation.camera.projection import FAR_M, View
from pytest_garl.simulation.camera.solids import Solids
from tests.support.pictures import CAMERA, LEVEL, poses, renderer

FINE = Camera(width_px=1280, height_px=960)
"""Fine, so that outlines of one pixel, where the renderers' conventions differ, weigh little."""


def _attitude(rng: np.random.Generator) -> tuple[float, float, float, float]:
    axis = rng.normal(size=3) * np.array([1.0, 1.0, 0.0])
    tilt, yaw = rng.uniform(0, 0.4), rng.uniform(-math.pi, math.pi)
    axis = axis / np.linalg.norm(axis) * math.sin(tilt / 2)
    w = math.cos(tilt / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cy * axis[0] - sy * axis[1],
        cy * axis[1] + sy * axis[0],
        sy * w,
        cy * w,
    )


def _bullet_frame(map: Any, objects: Any, eye: Any, q: Any) -> tuple[Any, Any]:
    """Depth and body index of the same triangles by pybullet's own renderer."""
    import pybullet as p

    client = p.connect(p.DIRECT)
    try:
        numbers = {}
        bodies = [(b.name, mesh_of(b.parts), b.position_m, b.yaw_rad) for b in map.bodies]
        for (name, kind), (at, yaw) in zip(map.present_objects, objects, strict=True):
            bodies.append((name, mesh_of(OBJECT_TYPES[kind].parts), at, yaw))
        for name, mesh, at, yaw in bodies:
            corners, _ = placed(mesh, at, yaw)
            vertices = corners.reshape(-1, 3)
            indices = np.arange(len(vertices)).reshape(-1, 3)
            # TinyRenderer culls by winding; give both sides.
            both = np.concatenate([indices, indices[:, ::-1]])
            for start in range(0, len(both), 600):
                part = both[start : start + 600]
                used, again = np.unique(part, return_inverse=True)
                shape = p.createVisualShape(
                    p.GEOM_MESH,
                    vertices=vertices[used].tolist(),
                    indices=again.ravel().tolist(),
                    physicsClientId=client,
                )
                numbers[p.createMultiBody(0, -1, shape, physicsClientId=client)] = name
        turn = np.array(p.getMatrixFromQuaternion(q)).reshape(3, 3)
        forward, up = -turn[:, 2], turn[:, 0]
        view = p.computeViewMatrix(eye, (np.array(eye) + forward).tolist(), up.tolist())
        fov = math.degrees(2 * math.atan(FINE.height_px / 2 / FINE.focal_px))
        near, far = 0.05, 100.0
        projection = p.computeProjectionMatrixFOV(fov, FINE.width_px / FINE.height_px, near, far)
        _, _, _, buffer, segments = p.getCameraImage(
            FINE.width_px,
            FINE.height_px,
            view,
            projection,
            renderer=p.ER_TINY_RENDERER,
            physicsClientId=client,
        )
        depth = far * near / (far - (far - near) * np.asarray(buffer).reshape(960, 1280))
        names = np.asarray(segments).reshape(960, 1280)
        return depth, {
            name: np.isin(names, [n for n, owner in numbers.items() if owner == name])
            for name in set(numbers.values())
        }
    finally:
        p.disconnect(client)


def _inside(map: Any, eye: tuple[float, float, float]) -> bool:
    """Whether the eye is within a solid, where no camera ever is."""
    return any(
        math.hypot(eye[0] - disc.x_m, eye[1] - disc.y_m) < disc.radius_m
        and disc.low_m < eye[2] < disc.high_m
        for body in map.bodies
        for disc in discs_of(body)
    )


@pytest.mark.sim
@pytest.mark.parametrize("name", ["court", "lawn"])
def test_geometry_agrees_with_pybullets_renderer(name: str) -> None:
    rng = np.random.default_rng(8)
    compared = 0
    made, map = renderer(name, camera=FINE)
    for _ in range(10):
        body = map.bodies[int(rng.integers(len(map.bodies)))]
        x, y = np.array(body.position_m[:2]) + rng.uniform(-2.5, 2.5, 2)
        eye, q = (float(x), float(y), float(rng.uniform(1.0, 9.0))), _attitude(rng)
        if _inside(map, eye):
            continue
        objects = poses(eye[0], eye[1])
        frame = made.render(eye, q, 0.0, objects)
        depth, masks = _bullet_frame(map, objects, eye, q)
        for body_name, mask in masks.items():
            ours = frame.segmentation == made.segment_ids[body_name]
            if min(mask.sum(), ours.sum()) < 8000:
                continue
            compared += 1
            assert (ours & mask).sum() / (ours | mask).sum() >= 0.95, body_name
            inner = cv2.erode((ours & mask).astype(np.uint8), np.ones((5, 5))).astype(bool)
            near = inner & (frame.depth_m < FAR_M)
            # On a steep face half a pixel between the renderers is a difference in depth.
            slope = np.hypot(*np.gradient(frame.depth_m))
            near &= slope < 0.1
            if near.any():
                excess = np.abs(frame.depth_m - depth)[near] - slope[near]
                assert np.quantile(excess, 0.98) < 0.02
    assert compared >= 6


def test_a_body_beside_the_camera_is_clipped_not_lost() -> None:
    made, map = renderer("lawn")
    tree = map.bodies[0]
    eye = (tree.position_m[0] + 0.4, tree.position_m[1], 2.0)
    frame = made.render(eye, LEVEL, 0.0, poses(0, 0))
    assert (frame.segmentation == made.segment_ids[tree.name]).sum() > 200
    assert np.isfinite(frame.depth_m).all()


def test_a_body_before_the_sky_has_its_own_depth_from_any_height() -> None:
    made, map = renderer("lawn")
    tree = map.bodies[0]
    half = math.radians(75) / 2
    level = (0.0, -math.sin(half), 0.0, math.cos(half))
    for height in np.linspace(3.9, 4.2, 31):
        eye = (tree.position_m[0] - 8.0, tree.position_m[1], float(height))
        frame = made.render(eye, level, 0.0, poses(0, 0))
        trunk = frame.segmentation == made.segment_ids[tree.name]
        assert trunk.sum() > 200
        assert frame.depth_m[trunk].max() < 15
        assert frame.depth_m.max() == FAR_M


@pytest.mark.parametrize("name", ["court", "lawn"])
def test_what_is_left_out_of_a_frame_could_not_be_seen(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, _ = renderer(name)
    rng, left_out = np.random.default_rng(5), 0
    everything = range(len(made._solids._static))
    for _ in range(30):
        x, y = (float(each) for each in rng.uniform(-9, 9, 2))
        turn = np.array([*rng.normal(0, 0.2, 2), *rng.normal(0, 1, 2)])
        qx, qy, qz, qw = (float(each) for each in turn / np.linalg.norm(turn))
        place, attitude = (x, y, float(rng.uniform(0.3, 12))), (qx, qy, qz, qw)
        frame = made.render(place, attitude, 0.0, poses(x, y))
        with monkeypatch.context() as patch:
            patch.setattr(Solids, "_in_view", lambda self, view: everything)
            whole = made.render(place, attitude, 0.0, poses(x, y))
        assert (frame.image == whole.image).all()
        assert (frame.depth_m == whole.depth_m).all()
        assert (frame.segmentation == whole.segmentation).all()
        left_out += len(everything) - len(made._solids._in_view(View.of(CAMERA, place, attitude)))
    assert left_out > 10
