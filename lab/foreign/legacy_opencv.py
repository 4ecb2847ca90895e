"""The ArUco functions of OpenCV 4.6 and before, on top of those of today.

OpenCV 4.7 replaced them by classes, and later versions removed them.  The defaults of the
detector's parameters are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Corners = tuple[NDArray[np.float32], ...]


def opencv(capture: Callable[..., Any]) -> ModuleType:
    """Return a ``cv2`` whose cameras ``capture`` makes, whose windows are not shown."""
    old = ModuleType("cv2")
    old.__dict__.update(vars(cv2))
    old.__dict__.update(
        VideoCapture=capture,
        imshow=_nothing,
        waitKey=lambda *_: -1,
        destroyAllWindows=_nothing,
        aruco=_aruco(),
    )
    return old


def _aruco() -> ModuleType:
    old = ModuleType("cv2.aruco")
    old.__dict__.update(vars(cv2.aruco))
    old.__dict__.update(
        DetectorParameters_create=cv2.aruco.DetectorParameters,
        detectMarkers=detect_markers,
        estimatePoseSingleMarkers=estimate_pose_single_markers,
        drawAxis=_nothing,
    )
    return old


def detect_markers(
    image: NDArray[np.uint8],
    dictionary: Any,
    parameters: Any = None,
    cameraMatrix: Any = None,
    distCoeff: Any = None,
) -> tuple[Corners, NDArray[np.int32] | None, Corners]:
    """Return corners (1, 4, 2) of each marker, ids (n, 1) or None, and rejected candidates.

    The camera served a refinement that is off by default.
    """
    detector = cv2.aruco.ArucoDetector(dictionary, parameters or cv2.aruco.DetectorParameters())
    corners: Any
    ids: Any
    rejected: Any
    corners, ids, rejected = detector.detectMarkers(image)
    # OpenCV 5 gives (n,).
    rows = None if ids is None or not len(corners) else np.asarray(ids, np.int32).reshape(-1, 1)
    return tuple(corners), rows, tuple(rejected)


def estimate_pose_single_markers(
    corners: Corners, markerLength: float, cameraMatrix: Any, distCoeffs: Any
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
    """Return rotations and translations (n, 1, 3) from camera to marker, and the corners (4, 3)."""
    half = markerLength / 2
    points = np.array(
        [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]], np.float32
    )
    turns, shifts = [], []
    for quad in corners:
        _, turn, shift = cv2.solvePnP(points, quad.reshape(4, 2), cameraMatrix, distCoeffs)
        turns.append(turn.reshape(1, 3))
        shifts.append(shift.reshape(1, 3))
    return np.array(turns), np.array(shifts), points


def _nothing(*_: Any, **__: Any) -> None:
    """Draw nothing."""
