"""Markers of every dictionary are painted so that OpenCV's own detector reads them."""

from __future__ import annotations

import dataclasses

import cv2
import pytest

from pytest_garl.fiducial import DICTIONARIES, MarkerSpec
from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.task import Task
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

HEIGHT_M = 4.0


@pytest.mark.parametrize("name", DICTIONARIES)
def test_the_stock_detector_reads_every_dictionary_straight_above(name: str) -> None:
    number = DICTIONARIES[name].size - 1
    task = Task(marker=MarkerSpec(dictionary=name, id=number))
    scenario = dataclasses.replace(nominal(), task=task)
    renderer = Renderer(Placed(scenario, EMPTY), Camera(), generator(scenario.seed, "sensor"))
    x, y = renderer.marker_m
    frame = renderer.render((x, y, HEIGHT_M), (0.0, 0.0, 0.0, 1.0), 0.0, [])
    family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    grey = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    _, ids, _ = cv2.aruco.ArucoDetector(family).detectMarkers(grey)
    assert ids is not None
    assert number in ids.ravel()
