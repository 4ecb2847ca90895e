"""The ArUco module follows `Mission`: every dictionary, side, camera and height of the search."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from landing_systems.modules.detection_opencv import OpenCvDetector
from pytest_garl import Camera, Detection, Mission, Observation
from pytest_garl.fiducial import DICTIONARIES, MarkerSpec
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)


def detections(
    marker: MarkerSpec, camera: Camera, height_m: float, search_m: float = 10.0
) -> tuple[tuple[Detection, ...], tuple[float, float]]:
    """Return what is found straight above a marker, and where the marker lies."""
    scenario = dataclasses.replace(nominal(), task=Task(marker=marker))
    renderer = Renderer(Placed(scenario, EMPTY), camera, generator(scenario.seed, "sensor"))
    x, y = renderer.marker_m
    frame = renderer.render((x, y, height_m), LEVEL, 0.0, [])
    mission = Mission(
        gps_position_m=(x, y),
        home_m=(0.0, 0.0, 0.0),
        search_altitude_m=search_m,
        marker_id=marker.id,
        marker_side_m=marker.side_m,
        marker_dictionary=marker.dictionary,
        camera=camera,
        time_limit_s=120.0,
    )
    observation = Observation(
        time_s=0.0,
        position_m=np.array((x, y, height_m)),
        velocity_mps=np.zeros(3),
        attitude=np.array(LEVEL),
        image=frame.image,
        depth_m=frame.depth_m,
    )
    return OpenCvDetector(mission).detect(observation), (x, y)


@pytest.mark.parametrize("name", DICTIONARIES)
def test_the_module_reads_every_dictionary_straight_above(name: str) -> None:
    marker = MarkerSpec(dictionary=name, id=DICTIONARIES[name].size - 1)
    found, place = detections(marker, Camera(), 5.0)
    assert [each.marker_id for each in found] == [marker.id]
    assert np.hypot(*np.subtract(found[0].position_m[:2], place)) < 0.1


@pytest.mark.parametrize(
    ("side_m", "camera", "search_m"),
    [
        (1.5, Camera(), 15.0),
        (1.0, Camera(width_px=640, height_px=480), 20.0),
        (0.5, Camera(width_px=640, height_px=480), 8.0),
        (4.0, Camera(), 30.0),
    ],
)
def test_the_module_reads_the_marker_from_the_height_of_the_search(
    side_m: float, camera: Camera, search_m: float
) -> None:
    marker = MarkerSpec(dictionary="DICT_4X4_50", id=7, side_m=side_m)
    found, _ = detections(marker, camera, search_m, search_m)
    assert 7 in [each.marker_id for each in found]


def test_a_perfect_square_whose_pose_has_no_numbers_is_no_marker(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nothing = np.full((3, 1), np.nan)
    monkeypatch.setattr(cv2, "solvePnP", lambda *_, **__: (True, nothing, nothing))
    found, _ = detections(MarkerSpec(), Camera(), 5.0)
    assert found == ()
