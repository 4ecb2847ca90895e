from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np
import pytest

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import WEATHER, genome_for
from pytest_garl.scenarios.maps.map import load_map, map_names
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.placement import marker_position_m
from pytest_garl.scenarios.validity import discs_of, repair
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.meshes import mesh_of, placed
from pytest_garl.simulation.camera.projection import FAR_M
from pytest_garl.simulation.camera.renderer import Renderer

CAMERA = Camera()
FINE = Camera(width_px=1280, height_px=960)
"""Fine, so that outlines of one pixel, where the renderers' conventions differ, weigh little."""
NONE: Mapping[str, float] = MappingProxyType({})
LEVEL = (0.0, 0.0, 0.0, 1.0)


def renderer(
    name: str = "lawn", seed: int = 0, camera: Camera = CAMERA, genes: Mapping[str, float] = NONE
) -> tuple[Renderer, Any]:
    map = dataclasses.replace(load_map(name), objects=(("person", 1), ("dog", 1), ("bird", 1)))
    genome = genome_for(map, weather="full")
    scenario = decode(genome.nominal, genome, map=name, seed=seed)
    scenario = repair(scenario, map)
    scenario = scenario.replace({f"environment.{key}": value for key, value in genes.items()})
    return Renderer(scenario, map, camera, np.random.default_rng(seed)), map


def poses(x: float, y: float) -> list[tuple[tuple[float, float, float], float]]:
    return [((x + 1.5, y, 0.0), 0.4), ((x - 1.6, y + 0.8, 0.0), 2.0), ((x, y - 1.4, 3.0), 1.0)]


def picture(seed: int = 0, height: float = 6.0, **genes: float) -> Frame:
    made, _ = renderer("lawn", seed, genes=genes)
    x, y = made.marker_m
    return made.render((x, y, height), LEVEL, 1.0, poses(x, y))


@pytest.mark.parametrize("gene", [name for name, _ in WEATHER])
@pytest.mark.parametrize("value", [0.15, 1.0])
def test_every_weather_gene_moves_the_picture(gene: str, value: float) -> None:
    clear, noisy = picture(), picture(seed=0, **{gene: value})
    changed = np.abs(clear.image.astype(int) - noisy.image.astype(int)).max(axis=2) > 12
    assert changed.sum() > 40


def test_the_sun_moves_the_picture() -> None:
    means = [picture(sun_position=p).image.mean() for p in (0.0, 0.1, 0.5)]
    assert means[0] < 0.5 * means[1] < means[2]


def test_fog_hides_more_the_farther_the_camera() -> None:
    def contrast(height: float) -> float:
        clear, foggy = picture(height=height), picture(height=height, fog=0.3)
        return float(foggy.image.std() / clear.image.std())

    assert contrast(2.0) > contrast(6.0) > contrast(10.0)


@pytest.mark.parametrize("height", [2.5, 10.0])
@pytest.mark.parametrize("name", map_names())
def test_the_marker_can_be_read_in_clear_weather(name: str, height: float) -> None:
    made, _ = renderer(name)
    x, y = made.marker_m
    frame = made.render((x + 0.1, y, height), LEVEL, 0.0, poses(x + 6, y))
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(frame.image)
    assert ids is not None
    assert 0 in ids


def test_the_same_arguments_give_the_same_bytes() -> None:
    genes = {"rain": 0.1, "maple_leaf": 0.5, "road_leaf": 0.1, "fog": 0.05}
    first, again = picture(seed=4, **genes), picture(seed=4, **genes)
    assert (first.image == again.image).all()
    assert (first.depth_m == again.depth_m).all()
    assert (first.image != picture(seed=5, **genes).image).any()


def test_an_image_asked_for_late_shows_its_own_moment() -> None:
    genes = {"rain": 0.3, "maple_leaf": 0.5, "road_leaf": 0.1, "fog": 0.05, "sun_position": 0.5}
    made, map = renderer("lawn", seed=4, genes=genes)
    x, y = made.marker_m
    tilted = (0.5, 0.0, 0.0, 0.866)
    late = made.render((x, y, 5.0), tilted, 1.0, poses(x, y))
    made.render((x + 2, y, 8.0), LEVEL, 2.0, poses(x + 1, y - 1))
    genome = genome_for(map, weather="full")
    clear = repair(decode(genome.nominal, genome, map="lawn", seed=4), map)
    made.change(clear.replace({"environment.road_snow": 0.9}))
    made.render((x + 2, y, 8.0), LEVEL, 3.0, poses(x - 1, y - 1))
    again, _ = renderer("lawn", seed=4, genes=genes)
    assert (late.image == again.render((x, y, 5.0), tilted, 1.0, poses(x, y)).image).all()
    assert (late.segmentation < 0).any(), "the horizon is part of this test"


def test_the_markers_area_agrees_with_its_pixels() -> None:
    made, _ = renderer()
    x, y = made.marker_m
    for height in (2.0, 4.0, 8.0):
        eye = (x + 0.3, y - 0.2, height)
        frame = made.render(eye, LEVEL, 0.0, poses(x + 6, y))
        counted = (frame.segmentation == 1).sum()
        side = made.marker_area_px(eye, LEVEL) ** 0.5
        # fillConvexPoly draws the outline as well: half a pixel on each side.
        assert counted**0.5 == pytest.approx(side, abs=1.2)


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
        for (name, kind), (at, yaw) in zip(map.object_names, objects, strict=True):
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


def test_marker_position_is_where_the_genes_say() -> None:
    made, map = renderer("court")
    genome = genome_for(map, weather="full")
    scenario = repair(decode(genome.nominal, genome, map="court", seed=0), map)
    assert made.marker_m == marker_position_m(scenario, map)


def test_places_under_leaves_are_those_that_are_painted_so() -> None:
    made, _ = renderer(genes={"road_leaf": 0.4})
    bare, _ = renderer()
    x, y = made.marker_m
    far_away = [((50.0, 50.0, 0.0), 0.0)] * 3
    frames = [each.render((x, y, 2.0), LEVEL, 0.0, far_away).image for each in (made, bare)]
    changed = np.abs(frames[0].astype(int) - frames[1].astype(int)).max(axis=2) > 30
    rows, columns = np.mgrid[20:220:3, 20:300:3].reshape(2, -1)
    # At zero yaw up is east and right is south; 2 m up a pixel is 2 m / 160.
    places = np.column_stack([x + (119.5 - rows) / 80, y - (columns - 159.5) / 80])
    agreed = made.covered(places) == changed[rows, columns]
    assert agreed.mean() > 0.9  # but for the leaves' edges
    assert 0.3 < made.covered(places).mean() < 0.5
    assert not bare.covered(places).any()


def test_another_marker_is_drawn_where_asked() -> None:
    _, map = renderer()
    genome = genome_for(map, weather="full")
    scenario = repair(decode(genome.nominal, genome, map="lawn", seed=0), map)
    other = Renderer(scenario, map, CAMERA, np.random.default_rng(0), marker_id=7)
    x, y = other.marker_m
    image = other.render((x, y, 3.0), LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)] * 3).image
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50))
    _, ids, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    assert np.ravel(ids).tolist() == [7]
