"""A lens bends the picture, depth, segments and what is recorded of the marker alike."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from landing_systems.modules.detection_opencv import CAMERA_FROM_BODY, OpenCvDetector
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector, ground_place
from pytest_garl import Camera, Mission, Observation
from pytest_garl.simulation.camera.frame import Frame
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.renderer import Renderer
from tests.support.pictures import LEVEL, poses, renderer

BARREL = (-0.28, 0.08, 0.001, -0.001, 0.0)
PINHOLE, LENS = (Camera(width_px=640, height_px=480, distortion=each) for each in ((), BARREL))
PLACES_M = ((0.0, 0.0), (3.0, 0.0), (-3.0, 4.0), (3.2, -4.2), (0.5, 4.6))
HEIGHT_M = 6.0


def at(camera: Camera, off_m: tuple[float, float]) -> tuple[Frame, Renderer, tuple[float, ...]]:
    made, _ = renderer(camera=camera)
    x, y = made.marker_m
    eye = (x - off_m[0], y - off_m[1], HEIGHT_M)
    far_away = [((50.0, 50.0, 0.0), 0.0)] * 3
    return made.render(eye, LEVEL, 0.0, far_away), made, eye


def projected(made: Renderer, eye: tuple[float, ...], camera: Camera) -> np.ndarray:
    """Return the pixels of the marker's corners by OpenCV."""
    corners = np.column_stack([np.array(made.pad.main.outline_m), np.zeros(4)])
    axes = View.of(camera, (eye[0], eye[1], eye[2]), LEVEL).axes
    seen = (corners - eye) @ axes.T
    lens = np.array(camera.distortion) if camera.distortion else None
    pixels, _ = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), camera.matrix, lens)
    return np.asarray(pixels).reshape(4, 2)


@pytest.mark.parametrize("off_m", PLACES_M)
def test_corners_are_where_opencv_projects_them(off_m: tuple[float, float]) -> None:
    frame, made, eye = at(LENS, off_m)
    wanted = projected(made, eye, LENS)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    quads, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(
        cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
    )
    found = [quad for quad, number in zip(quads, np.ravel(ids), strict=True) if number == 0]
    assert len(found) == 1
    away = np.abs(np.asarray(found[0]).reshape(4, 2)[:, None] - wanted).max(axis=2).min(axis=0)
    assert away.max() < 1.0
    rows, columns = np.nonzero(frame.segmentation == 1)
    middle = np.array([columns.mean(), rows.mean()])
    assert middle == pytest.approx(wanted.mean(axis=0), abs=1.0)


def test_depth_segments_and_counts_are_bent_alike() -> None:
    made, _ = renderer(camera=LENS)
    x, y = made.marker_m
    frame = made.render((x, y, 5.0), LEVEL, 0.0, poses(x, y))
    assert frame.image.shape == (480, 640, 3)
    assert frame.depth_m.shape == frame.segmentation.shape == (480, 640)
    for name, number in made.segment_ids.items():
        if number > 0:
            assert frame.pixels[number] == np.count_nonzero(frame.segmentation == number), name
    assert frame.pixels[made.segment_ids["person-1"]] > 0
    # Level and above flat ground, depth is the height wherever nothing stands.
    assert frame.depth_m[frame.segmentation == 0] == pytest.approx(5.0, abs=0.01)
    assert made.marker_pixels((x, y, 5.0), LEVEL) >= frame.pixels[1]


@pytest.mark.parametrize("off_m", PLACES_M)
def test_what_is_recorded_of_the_marker_is_about_the_bent_picture(
    off_m: tuple[float, float],
) -> None:
    frame, made, eye = at(LENS, off_m)
    corners, seen = projected(made, eye, LENS), frame.marker
    assert seen is not None
    area = cv2.contourArea(corners.astype(np.float32)) / 49
    assert seen.px_per_module <= np.sqrt(area) + 0.2
    right, bottom = 639.5 - corners[:, 0].max(), 479.5 - corners[:, 1].max()
    room = min(corners.min() + 0.5, right, bottom) / seen.px_per_module
    assert seen.edge_modules == pytest.approx(min(1.0, room), abs=0.05)
    outline = made.marker_outline((eye[0], eye[1], eye[2]), LEVEL)
    assert np.abs(outline[::8] - corners).max() < 0.05


def test_a_barrel_shows_more_than_a_pinhole() -> None:
    off_m = (0.0, 7.0)
    assert at(PINHOLE, off_m)[0].pixels[1] == 0
    assert at(LENS, off_m)[0].pixels[1] > 100


def mission(camera: Camera) -> Mission:
    return Mission(
        gps_position_m=(0.0, 0.0),
        home_m=(0.0, 0.0, 0.0),
        search_altitude_m=10.0,
        marker_id=0,
        marker_side_m=1.5,
        marker_dictionary="DICT_5X5_50",
        camera=camera,
        time_limit_s=120.0,
    )


@pytest.mark.parametrize("detector", [OpenCvDetector, TphYoloDetector])
@pytest.mark.parametrize("off_m", PLACES_M[2:])
def test_the_reference_detectors_undo_the_lens(
    detector: type[OpenCvDetector] | type[TphYoloDetector], off_m: tuple[float, float]
) -> None:
    frame, made, eye = at(LENS, off_m)
    observation = Observation(
        time_s=0.0,
        position_m=np.array(eye),
        velocity_mps=np.zeros(3),
        attitude=np.array(LEVEL),
        image=frame.image,
        depth_m=frame.depth_m,
    )
    errors = [
        np.hypot(*np.subtract(found.position_m[:2], made.marker_m))
        for camera in (LENS, PINHOLE)
        for found in detector(mission(camera)).detect(observation)
        if found.marker_id == 0
    ]
    assert errors[0] < 0.15
    # Without the coefficients the place is wrong, or the pose is refused as impossible.
    assert all(error > 0.3 for error in errors[1:])


def test_a_ray_is_that_of_the_lens() -> None:
    frame, _, _ = at(LENS, (0.0, 0.0))
    observation = Observation(
        time_s=0.0,
        position_m=np.array([0.0, 0.0, 5.0]),
        velocity_mps=np.zeros(3),
        attitude=np.array(LEVEL),
        image=frame.image,
        depth_m=frame.depth_m,
    )
    ray = np.array([[0.7, -0.5, 1.0]])
    pixel, _ = cv2.projectPoints(
        ray, np.zeros(3), np.zeros(3), LENS.matrix, np.array(LENS.distortion)
    )
    place = ground_place(np.asarray(pixel).reshape(2) + 0.5, LENS, observation)
    assert place is not None
    assert place[0] == pytest.approx(5 * (CAMERA_FROM_BODY.T @ ray[0])[:2], abs=0.01)
