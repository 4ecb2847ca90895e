"""Any marker of OpenCV's dictionaries is drawn so that OpenCV reads it, at any yaw and size."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np
import pytest

from pytest_garl import Camera, MarkerSpec, NestedMarker
from pytest_garl.fiducial import DICTIONARIES
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.renderer import Renderer
from tests.support.pictures import LEVEL

LAWN = dataclasses.replace(load_map("lawn"), objects=())
CAMERA = Camera()


def renderer(spec: MarkerSpec) -> Renderer:
    genome = genome_for(LAWN, task=Task(marker=spec))
    scenario = repair(decode(genome.nominal, genome, map="lawn", seed=1), LAWN)
    return Renderer(Placed(scenario, LAWN), CAMERA, np.random.default_rng(0))


def look(made: Renderer, height: float, offset: tuple[float, float] = (0.0, 0.0)) -> Frame:
    x, y = made.marker_m
    return made.render((x + offset[0], y + offset[1], height), LEVEL, 0.0, [])


def ids_in(frame: Frame, dictionary: str) -> list[int]:
    family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    _, ids, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    return [] if ids is None else sorted(int(each) for each in np.ravel(ids))


@pytest.mark.parametrize("name", DICTIONARIES)
def test_a_marker_of_any_dictionary_is_read(name: str) -> None:
    last = DICTIONARIES[name].size - 1
    frame = look(renderer(MarkerSpec(dictionary=name, id=last, side_m=1.0)), 3.0)
    assert last in ids_in(frame, name)
    seen, modules = frame.marker, DICTIONARIES[name].bits + 2
    assert seen is not None
    assert seen.px_per_module == pytest.approx(CAMERA.focal_px / modules / 3.0, rel=0.01)
    assert seen.border_hidden + seen.bits_hidden + seen.margin_hidden < 0.02
    assert seen.contrast > 180


@pytest.mark.parametrize("side", [0.1, 0.5, 4.0])
def test_a_marker_of_any_size_is_read_from_two_and_a_half_sides_above(side: float) -> None:
    made = renderer(MarkerSpec(id=9, side_m=side))
    assert ids_in(look(made, 2.5 * side), "DICT_5X5_50") == [9]
    assert made.marker_side_px(2.5 * side) == pytest.approx(CAMERA.focal_px / 2.5)


def test_a_nested_marker_is_read_where_the_large_one_does_not_fit() -> None:
    spec = MarkerSpec(nested=(NestedMarker(id=7, side_m=0.2, offset_m=(1.2, 0.4)),))
    made = renderer(spec)
    # From here a module of the small marker is no more than a pixel wide.
    assert ids_in(look(made, 4.0), "DICT_5X5_50") == [0]
    near = look(made, 0.6, (1.2, 0.4))
    assert ids_in(near, "DICT_5X5_50") == [7]
    seen = near.marker
    assert seen is not None
    assert seen.px_per_module == pytest.approx(CAMERA.focal_px * 0.2 / 7 / 0.6, rel=0.02)
    assert seen.edge_modules == 1.0


def test_a_view_without_a_whole_nested_marker_is_that_of_the_large_one() -> None:
    nested = NestedMarker(id=7, side_m=0.2, offset_m=(1.2, 0.4))
    plain, board = renderer(MarkerSpec()), renderer(MarkerSpec(nested=(nested,)))
    assert look(board, 5.0).marker == look(plain, 5.0).marker
    cut = look(board, 0.6, (-0.8, 0.0)).marker
    assert cut is not None
    assert cut.edge_modules < 0


def test_a_nested_marker_over_the_large_ones_bits_hides_them() -> None:
    covering = NestedMarker(id=7, side_m=0.4, offset_m=(0.0, 0.0))
    seen = look(renderer(MarkerSpec(nested=(covering,))), 5.0).marker
    assert seen is not None
    assert 0.05 < seen.bits_hidden < 0.5
    assert seen.border_hidden < 0.02


def test_the_marker_lies_at_its_place_in_the_picture() -> None:
    made = renderer(MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=3, side_m=1.0))
    frame = look(made, 4.0, (0.5, -0.3))
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    corners, _, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    # At zero yaw the picture's top is east and its right is south.
    u, v = np.asarray(corners[0]).reshape(4, 2).mean(axis=0)
    (cx, cy), scale = CAMERA.centre_px, CAMERA.focal_px / 4.0
    assert math.dist((u, v), (cx - 0.3 * scale, cy + 0.5 * scale)) < 1.0
