"""An exposure time blurs by the camera's movement; dirt hides a share of the picture."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.camera.exposure import Movement, Optics
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.projection import View, eye_under
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.randomness import generator
from tests.support.flights import EMPTY, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)
FLIES_EAST = Movement(velocity_mps=(3.0, 0.0, 0.0))
ROLLS = Movement(spin_radps=(1.0, 0.0, 0.0))


def frame_of(movement: Movement, **values: float) -> Frame:
    scenario = nominal(**values)
    renderer = Renderer(Placed(scenario, EMPTY), Camera(), generator(5, "sensor"))
    eye = eye_under((*renderer.marker_m[:2], 6.05), LEVEL)
    return renderer.render(eye, LEVEL, 0.0, [], movement)


def blur_px(movement: Movement, exposure_ms: float, camera: Camera) -> float:
    scenario = nominal(camera__exposure_ms=exposure_ms)
    view = View.of(camera, (0.0, 0.0, 6.0), LEVEL)
    return Optics(scenario, camera).exposure(view, movement).blur_px(np.array(camera.centre_px))


def test_the_blur_is_as_long_as_the_movement_over_the_picture() -> None:
    camera = Camera()
    # 3 m/s for 0.05 s at 6 m, and 1 rad/s for 0.05 s.
    assert blur_px(FLIES_EAST, 50.0, camera) == pytest.approx(camera.focal_px * 0.15 / 6)
    turned = 2 * camera.focal_px * math.tan(0.025)
    assert blur_px(ROLLS, 50.0, camera) == pytest.approx(turned)
    assert blur_px(Movement(spin_radps=(0.0, 0.0, 1.0)), 50.0, camera) == pytest.approx(0, abs=1e-6)


def test_an_exposure_ends_before_the_next_frame() -> None:
    fast = Camera(rate_hz=50.0)
    assert blur_px(ROLLS, 100.0, fast) == pytest.approx(blur_px(ROLLS, 20.0, fast))


@pytest.mark.parametrize(("movement", "axis"), [(FLIES_EAST, 0), (ROLLS, 1)])
def test_the_picture_blurs_along_the_movement(movement: Movement, axis: int) -> None:
    # East is the image's top, so a flight to the east blurs rows, and a roll columns.  Squares: a
    # blurred edge is as high as a sharp one, in many small steps.
    sharp, blurred = (
        frame_of(movement, camera__exposure_ms=each).image.astype(float) for each in (0.0, 60.0)
    )
    steps = [
        (np.diff(each[80:160, 120:200], axis=along) ** 2).mean()
        for each in (sharp, blurred)
        for along in (axis, 1 - axis)
    ]
    along, across, blurred_along, blurred_across = steps
    assert blurred_along / along < 0.6 * blurred_across / across
    assert blurred.mean() == pytest.approx(sharp.mean(), abs=0.5)


def test_a_camera_at_rest_is_sharp() -> None:
    sharp, long = (frame_of(Movement(), camera__exposure_ms=each).image for each in (0.0, 60.0))
    assert np.array_equal(sharp, long)


def test_noise_is_not_blurred() -> None:
    def noise(exposure_ms: float) -> float:
        scenario = nominal(camera__exposure_ms=exposure_ms, environment__sun_position=0.999)
        renderer = Renderer(Placed(scenario, EMPTY), Camera(), generator(5, "sensor"))
        eye = eye_under((*renderer.marker_m[:2], 6.05), LEVEL)
        frames = [renderer.render(eye, LEVEL, at, [], ROLLS).image for at in (0.0, 0.1)]
        return float(np.std(np.subtract(*frames, dtype=float)))

    assert noise(60.0) == pytest.approx(noise(0.0), rel=0.1)


def test_dirt_hides_its_share_of_the_picture() -> None:
    scenario, camera = nominal(camera__dirt_percent=20.0), Camera()
    view = View.of(camera, (0.0, 0.0, 6.0), LEVEL)
    rows, columns = np.indices((camera.height_px, camera.width_px))
    clear = Optics(scenario, camera).exposure(view, Movement()).clear(rows, columns)
    assert clear is not None
    assert np.mean(clear <= 0.55) == pytest.approx(0.2, abs=0.01)
    assert clear.min() < 0.3
    white = np.full((camera.height_px, camera.width_px, 3), 200, np.uint8)
    seen = Optics(scenario, camera).exposure(view, Movement()).soiled(white)
    # Half of what the dirt takes is scattered.
    assert seen[..., 0] == pytest.approx(200 * (clear + (1 - clear) / 2), abs=2)


def test_the_marker_view_knows_blur_and_dirt() -> None:
    sharp, blurred = (frame_of(FLIES_EAST, camera__exposure_ms=each).marker for each in (0.0, 50.0))
    soiled = frame_of(FLIES_EAST, camera__dirt_percent=80.0).marker
    assert sharp is not None
    assert blurred is not None
    assert soiled is not None
    assert sharp.blur_px == 0.0
    assert blurred.blur_px == pytest.approx(160 * 0.15 / 6, abs=0.01)
    assert soiled.contrast < 0.8 * sharp.contrast
