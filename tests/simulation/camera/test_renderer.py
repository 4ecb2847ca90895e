from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups import WEATHER
from pytest_garl.scenarios.maps.loading import map_names
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera import renderer as renderer_module
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.ground import Raster
from pytest_garl.simulation.camera.renderer import Renderer
from tests.support.pictures import CAMERA, LEVEL, poses, renderer


@functools.cache
def unmoved_renderer() -> Renderer:
    return renderer()[0]


def picture(seed: int = 0, height: float = 6.0, **genes: float) -> Frame:
    made, _ = renderer("lawn", seed, genes=genes)
    x, y = made.marker_m
    return made.render((x, y, height), LEVEL, 1.0, poses(x, y))


@pytest.mark.parametrize("gene", [key.partition(".")[2] for key in WEATHER])
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


def test_the_markers_area_agrees_with_its_pixels() -> None:
    made, _ = renderer()
    x, y = made.marker_m
    for height in (2.0, 4.0, 8.0):
        eye = (x + 0.3, y - 0.2, height)
        frame = made.render(eye, LEVEL, 0.0, poses(x + 6, y))
        counted = (frame.segmentation == 1).sum()
        side = frame.marker_area_px**0.5
        # fillConvexPoly draws the outline as well: half a pixel on each side.
        assert counted**0.5 == pytest.approx(side, abs=1.2)


def test_marker_position_is_where_the_genes_say() -> None:
    made, map = renderer("court")
    genome = genome_for(map, weather="full")
    scenario = repair(decode(genome.nominal, genome, map="court", seed=0), map)
    assert made.marker_m == Placed(scenario, map).marker_m


def test_another_marker_is_drawn_where_asked() -> None:
    _, map = renderer()
    genome = genome_for(map, weather="full")
    scenario = repair(decode(genome.nominal, genome, map="lawn", seed=0), map)
    scenario = dataclasses.replace(scenario, task=Task(marker=MarkerSpec(id=7)))
    other = Renderer(Placed(scenario, map), CAMERA, np.random.default_rng(0))
    x, y = other.marker_m
    image = other.render((x, y, 3.0), LEVEL, 0.0, [((50.0, 50.0, 0.0), 0.0)] * 3).image
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50))
    _, ids, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    assert np.ravel(ids).tolist() == [7]


@given(
    st.floats(-12, 12), st.floats(-9, 9), st.floats(0.3, 13), st.floats(-3, 3), st.floats(-0.3, 0.3)
)
def test_the_border_that_is_not_reached_does_not_change_the_ground(
    x: float, y: float, height: float, yaw: float, roll: float
) -> None:
    made = unmoved_renderer()
    attitude = (
        math.sin(roll / 2) * math.cos(yaw / 2),
        math.sin(roll / 2) * math.sin(yaw / 2),
        math.cos(roll / 2) * math.sin(yaw / 2),
        math.cos(roll / 2) * math.cos(yaw / 2),
    )

    def image() -> NDArray[np.uint8]:
        return made.render((x, y, height), attitude, 0.0, poses(40.0, 40.0)).image

    fast = image()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pytest_garl.simulation.camera.renderer._stays_within", lambda *_: False)
        assert (fast == image()).all()


def test_ground_that_the_fine_piece_hides_is_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[float] = []

    def noted(raster: Raster, *rest: Any) -> None:
        drawn.append(raster.m_per_px)
        warp(raster, *rest)

    warp = renderer_module._warp
    monkeypatch.setattr(renderer_module, "_warp", noted)
    fast = picture(height=0.8).image
    assert len(drawn) == 1
    monkeypatch.setattr(renderer_module, "_stays_within", lambda *rest: False)
    assert (picture(height=0.8).image == fast).all()
    assert len(drawn) == 3
