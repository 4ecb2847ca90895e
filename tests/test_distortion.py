"""Lens distortion is OpenCV's model, and is undone exactly."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.distortion import distorted, undistorted
from pytest_garl.errors import LandingSystemError

LENSES = (
    (-0.28, 0.08, 0.0, 0.0),
    (-0.28, 0.08, 0.001, -0.002, -0.01),
    (0.1, 0.02, 0.0, 0.001, 0.0),
    (0.2, 0.1, 0.0, 0.0, 0.01, 0.4, 0.1, 0.01),
)


@pytest.mark.parametrize("lens", LENSES)
def test_the_model_is_that_of_opencv(lens: tuple[float, ...]) -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (50, 2)) * (1.2, 0.8)
    rays = np.column_stack([points, np.ones(50)])
    theirs, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), np.array(lens))
    assert distorted(points, lens) == pytest.approx(theirs.reshape(-1, 2), abs=1e-12)


@pytest.mark.parametrize("lens", LENSES)
def test_what_is_distorted_is_undistorted(lens: tuple[float, ...]) -> None:
    points = np.random.default_rng(2).uniform(-1, 1, (50, 2)) * (1.0, 0.75)
    found = undistorted(distorted(points, lens), lens)
    assert found is not None
    assert found == pytest.approx(points, abs=1e-9)


def test_a_place_beyond_the_fold_has_no_origin() -> None:
    # r (1 - r^2 / 2) grows up to 0.54 only.
    assert undistorted(np.array([[0.6, 0.0]]), (-0.5, 0.0, 0.0, 0.0)) is None
    assert undistorted(np.array([[0.5, 0.0]]), (-0.5, 0.0, 0.0, 0.0)) is not None


def test_a_camera_keeps_plain_floats_and_no_lens_without_distortion() -> None:
    camera = Camera(distortion=tuple(np.array([-0.2, 0.05, 0, 0])))
    assert camera.distortion == (-0.2, 0.05, 0.0, 0.0)
    assert {type(each) for each in camera.distortion} == {float}
    assert Camera(distortion=(0.0,) * 5) == Camera()


@pytest.mark.parametrize(
    ("lens", "words"),
    [
        ((0.1, 0.2), "distortion = (0.1, 0.2); expected a tuple of 4, 5 or 8 finite numbers"),
        ((float("nan"), 0.0, 0.0, 0.0), "expected a tuple of 4, 5 or 8 finite numbers"),
        ("wide", "distortion = 'wide'; expected a tuple"),
        (0.1, "distortion = 0.1; expected a tuple"),
        ((-0.5, 0.0, 0.0, 0.0), "folds back within the picture of 320 x 240 px"),
        ((1e300, 1e300, 0.0, 0.0), "expected"),
        (
            (1.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0),
            "times what a pinhole shows",
        ),
    ],
)
def test_a_lens_that_cannot_be_drawn_is_refused(lens: object, words: str) -> None:
    with pytest.raises(LandingSystemError) as refused:
        Camera(distortion=lens)  # type: ignore[arg-type]
    assert words in str(refused.value)
