"""Whether detections are right, against what is true about a picture's markers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lab.train_detector.scenes import CAMERA, Marker, Picture
from pytest_garl import Detection, Mission, Observation
from pytest_garl.fiducial import MARKER_SIDE_M
from pytest_garl.scenarios.placed import MARKER_DICTIONARY

Kind = Literal["right", "wrong-id", "nothing-there"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """A detection, what it is, and the marker that it lies on, if any."""

    detection: Detection
    kind: Kind
    marker: Marker | None


def score(picture: Picture, found: Sequence[Detection]) -> tuple[Scored, ...]:
    """Judge each detection by the marker in whose outline the middle of its box lies.

    A second detection of a marker with the same id is right as well: nobody lands elsewhere.
    """
    return tuple(_scored(picture, detection) for detection in found)


def _scored(picture: Picture, detection: Detection) -> Scored:
    u, v = np.mean(detection.corners_px, axis=0) + 0.5
    best, nearest = None, math.inf
    for marker in picture.markers:
        away = max(
            2 * abs(u - marker.centre_px[0]) / marker.size_px[0],
            2 * abs(v - marker.centre_px[1]) / marker.size_px[1],
        )
        if away < min(1.0, nearest):
            best, nearest = marker, away
    if best is None:
        return Scored(detection=detection, kind="nothing-there", marker=None)
    kind: Kind = "right" if best.marker_id == detection.marker_id else "wrong-id"
    return Scored(detection=detection, kind=kind, marker=best)


def mission() -> Mission:
    """Return the paper's mission with the camera of the pictures."""
    return Mission(
        gps_position_m=(0.0, 0.0),
        home_m=(0.0, 0.0, 0.0),
        search_altitude_m=10.0,
        marker_id=0,
        marker_side_m=MARKER_SIDE_M,
        marker_dictionary=MARKER_DICTIONARY,
        camera=CAMERA,
        time_limit_s=120.0,
    )


def observation_of(picture: Picture) -> Observation:
    """Return what a landing system would have been given."""
    return Observation(
        time_s=picture.time_s,
        position_m=np.array(picture.position_m),
        velocity_mps=np.zeros(3),
        attitude=np.array(picture.attitude),
        image=picture.frame.image,
        depth_m=picture.frame.depth_m,
    )
