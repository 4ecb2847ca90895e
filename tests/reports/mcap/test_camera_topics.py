"""The marker's outline lies on the marker: by calibration, transforms and the picture itself."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Camera, Detection, Diagnostics
from pytest_garl.reports.mcap.export import Export, Place
from pytest_garl.scenarios.placed import Placed
from tests.reports.mcap.conftest import Exported
from tests.support.flights import EMPTY, nominal
from tests.support.mcap_files import (
    Recording,
    matrix_to_world,
    needs_extra,
    outline_of,
    picture_of,
    read_mcap,
)
from tests.support.recorded_flights import recorded, seen
from tests.support.videos import CORNERS, SPEAKS_FROM_S

needs_extra()
PINHOLE = Camera(width_px=640, height_px=480)
MODELS = {
    "pinhole": PINHOLE,
    "plumb bob": dataclasses.replace(PINHOLE, distortion=(-0.12, 0.02, 0.002, -0.001, -0.001)),
    "rational": dataclasses.replace(
        PINHOLE, distortion=(-0.1, 0.02, 0.001, 0.001, 0.0, 0.05, 0.01, 0.0)
    ),
}
TURNED = {
    "camera.mounting_roll_deg": 2.0,
    "camera.mounting_pitch_deg": -1.5,
    "camera.mounting_yaw_deg": 3.0,
    "camera.calibration_error_percent": 2.0,
}
COUNT = 40


def over_the_marker(**genes: float) -> tuple[Flight, Place]:
    """Return a record of a UAV that passes over the marker, tilted and turning."""
    scenario = nominal(**{"pad.yaw_deg": 25.0, **genes})
    x, y = Placed(scenario, EMPTY).pad.place_m
    share = np.linspace(-1.0, 1.0, COUNT)
    places = np.stack([x + 1.5 * share, y - share, 5.0 + share], axis=1)
    flight = recorded(
        steps=seen(range(100), count=16), places=places, end_s=COUNT / 24, outcome="not_landed"
    )
    roll, pitch, yaw = 0.06 + 0 * share, 0.05 * share, 0.4 + 0.5 * share
    attitude = np.stack(
        [np.sin(roll / 2), np.sin(pitch / 2), np.sin(yaw / 2), np.ones(COUNT)], axis=1
    )
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    uav = dataclasses.replace(flight.uav, attitude=attitude)
    flight = dataclasses.replace(flight, uav=uav, marker_position_m=(x, y))
    return flight, Place(placed=Placed(scenario, EMPTY), camera=None)


def export(flight: Flight, place: Place, folder: Path) -> Recording:
    from pytest_garl.reports.mcap.writer import write_mcap

    path = folder / "flight.mcap"
    write_mcap(Export(name="it", flight=flight, place=place), path)
    return read_mcap(path)


def projected(recording: Recording, time_ns: int, corners_m: NDArray[np.float64]) -> NDArray[Any]:
    """Project corners (n, 3) by what the file says of frames and camera, as OpenCV does."""
    camera = recording.at("/camera/calibration", time_ns)
    to_camera = np.linalg.inv(matrix_to_world(recording.at("/tf", time_ns), camera.frame_id))
    turn, _ = cv2.Rodrigues(to_camera[:3, :3])
    matrix = np.array(camera.K).reshape(3, 3)
    found, _ = cv2.projectPoints(
        corners_m, turn, to_camera[:3, 3], matrix, np.array(camera.D, np.float64)
    )
    return np.asarray(found).reshape(-1, 2)


@pytest.mark.parametrize(
    ("model", "turned"),
    [
        ("pinhole", False),
        ("plumb bob", True),
        ("rational", True),
        pytest.param("pinhole", True, marks=pytest.mark.long),
        pytest.param("plumb bob", False, marks=pytest.mark.long),
        pytest.param("rational", False, marks=pytest.mark.long),
    ],
)
def test_the_outline_lies_on_the_marker(model: str, turned: bool, tmp_path: Path) -> None:
    flight, place = over_the_marker(**(TURNED if turned else {}))
    camera = MODELS[model]
    recording = export(flight, dataclasses.replace(place, camera=camera), tmp_path)
    corners = np.array([(x, y, 0.0) for x, y in place.placed.pad.main.outline_m])
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50))
    read = 0
    assert len(recording.topics["/camera/image"]) == 16
    for time_ns, message in recording.topics["/camera/image"]:
        outline = outline_of(recording.at("/camera/annotations", time_ns))
        # A lens bends sides, so that their places are listed too.
        outline = outline[:: len(outline) // 4]
        assert np.abs(projected(recording, time_ns, corners) - outline).max() < 0.05
        found, ids, _ = detector.detectMarkers(picture_of(message))
        if ids is not None and ids.ravel().tolist() == [0]:
            read += 1
            assert np.abs(found[0].reshape(-1, 2) - outline).max() < 1.5
    assert read > 10


def test_the_calibration_is_that_of_the_true_camera(tmp_path: Path) -> None:
    flight, place = over_the_marker(**TURNED)
    camera = MODELS["plumb bob"]
    recording = export(flight, dataclasses.replace(place, camera=camera), tmp_path)
    (_, first), *_ = recording.topics["/camera/calibration"]
    assert (first.width, first.height, first.frame_id) == (640, 480, "camera")
    assert first.distortion_model == "plumb_bob"
    assert tuple(first.D) == camera.distortion
    assert first.K[0] == pytest.approx(1.02 * camera.focal_px)
    assert list(first.K[2::3]) == [*camera.centre_px, 1.0]
    assert np.array(first.P).reshape(3, 4)[:, :3].ravel().tolist() == list(first.K)
    told = [message.message for _, message in recording.topics["/events"]]
    assert any("focal length differs by +2.0 %" in each for each in told)
    assert any("camera is turned" in each for each in told)


def test_a_detection_is_outlined_in_its_own_picture(exported: Exported) -> None:
    for time_ns, message in exported.recording.topics["/camera/annotations"]:
        shown = [outline_of(message, index) for index in range(len(message.points))]
        reported = [each for each in shown if np.allclose(each, CORNERS)]
        assert len(reported) == (time_ns >= SPEAKS_FROM_S * 1e9)
        assert [each.text for each in message.texts] == ["id 0  0.90"] * len(reported)


def test_detections_without_corners_and_targets_are_circles(tmp_path: Path) -> None:
    flight, place = over_the_marker()
    x, y = flight.marker_position_m
    error = (0.5, -0.25, 0.1)
    believed = (x + error[0], y + error[1], error[2])
    found = Detection(marker_id=0, confidence=0.5, position_m=believed)
    steps = tuple(
        dataclasses.replace(
            step,
            estimation_error_m=error,
            diagnostics=Diagnostics(detections=(found,), target_m=believed),
        )
        for step in flight.steps
    )
    flight = dataclasses.replace(flight, steps=steps)
    recording = export(flight, dataclasses.replace(place, camera=MODELS["rational"]), tmp_path)
    centre = np.array([(x, y, 0.0)])
    for time_ns, message in recording.topics["/camera/annotations"]:
        (at,) = projected(recording, time_ns, centre)
        assert len(message.circles) == 2
        for circle in message.circles:
            place_px = circle.position.x - 0.5, circle.position.y - 0.5
            assert np.abs(np.array(place_px) - at).max() < 0.05


def test_pictures_are_those_that_the_system_saw(exported: Exported) -> None:
    pictures = [picture_of(message) for _, message in exported.recording.topics["/camera/image"]]
    assert len(pictures) == len(exported.seen) == 30
    for picture, saw in zip(pictures, exported.seen, strict=True):
        # The sensor's noise and the JPEG's loss.
        assert np.abs(picture.astype(float) - saw).mean() < 4.0
