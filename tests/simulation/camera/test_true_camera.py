"""The true camera is turned and scaled as the scenario says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.projection import eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.camera.true_camera import Mounting, true_camera
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)


def centre_of_marker(**values: float) -> tuple[np.ndarray, Renderer]:
    scenario = nominal(**values)
    camera = true_camera(Camera(), scenario)
    renderer = Renderer(Placed(scenario, EMPTY), camera, generator(5, "sensor"), colour=False)
    place = (*renderer.marker_m[:2], 10.0)
    eye = eye_under(place, LEVEL)
    frame = renderer.render(eye, Mounting(scenario).attitude(LEVEL), 0.0, [])
    rows, columns = np.nonzero(frame.segmentation == 1)
    return np.array([columns.mean() - 159.5, rows.mean() - 119.5]), renderer


@pytest.mark.parametrize(
    ("axis", "towards"),
    # It looks to the left (the marker goes right), and backwards (the marker goes up).
    [("roll", (1.0, 0.0)), ("pitch", (0.0, -1.0))],
)
def test_a_turned_camera_moves_the_marker_by_its_angle(
    axis: str, towards: tuple[float, float]
) -> None:
    off, renderer = centre_of_marker(**{f"camera__mounting_{axis}_deg": 10.0})
    wanted = renderer.camera.focal_px * math.tan(math.radians(10.0)) * np.array(towards)
    assert off == pytest.approx(wanted, abs=1.5)


def test_a_yaw_of_the_mounting_turns_the_attitude_to_the_left() -> None:
    turned = Mounting(nominal(camera__mounting_yaw_deg=10.0)).attitude(LEVEL)
    assert turned == pytest.approx((0, 0, math.sin(math.radians(5)), math.cos(math.radians(5))))


def test_a_calibration_error_lengthens_the_focal_length() -> None:
    camera = true_camera(Camera(), nominal(camera__calibration_error_percent=10.0))
    assert camera.focal_px == pytest.approx(1.1 * Camera().focal_px)


def test_a_nominal_camera_is_the_declared_one() -> None:
    camera = Camera()
    assert true_camera(camera, nominal()) is camera
    assert Mounting(nominal()).attitude(LEVEL) is LEVEL
