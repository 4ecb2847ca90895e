"""Marker detection with OpenCV's ArUco detector, with the pose from the corners."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl import Camera, Detection, Mission, Observation

_CAMERA_FROM_BODY = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Image right is the body's -y, image down its -x, the optical axis its -z."""
CELLS = 7
MEDIAN_SHARE = 0.7
MAX_REPROJECTION_PX = 2.0
HEIGHT_TOLERANCE = 0.35
"""A marker on the ground lies as far below as the altimeter says, give or take a third; what
does not is no marker."""


class OpenCvDetector:
    """Finds markers in frames and places them in the world."""

    def __init__(self, mission: Mission) -> None:
        dictionary = cv2.aruco.getPredefinedDictionary(
            getattr(cv2.aruco, mission.marker_dictionary)
        )
        parameters = cv2.aruco.DetectorParameters()
        # 24 px of side at 10 m in 320x240 is a perimeter rate of 0.3; half of that is noise.
        parameters.minMarkerPerimeterRate = 0.12
        parameters.adaptiveThreshWinSizeMin = 5
        parameters.adaptiveThreshWinSizeMax = 25
        parameters.adaptiveThreshWinSizeStep = 10
        # Leaves and snow on the border bend its outline and flip its bits.
        parameters.polygonalApproxAccuracyRate = 0.06
        parameters.maxErroneousBitsInBorderRate = 0.5
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        self._camera: Camera = mission.camera
        self._wanted = mission.marker_id
        self._side_m = mission.marker_side_m
        half = mission.marker_side_m / 2
        self._corners = np.array(
            [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]]
        )

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Return all markers in the frame whose pose is plausible."""
        grey = np.asarray(cv2.cvtColor(observation.image, cv2.COLOR_RGB2GRAY))
        found = self._find(grey, observation)
        if not any(item.marker_id == self._wanted for item in found):
            found += self._find(cv2.medianBlur(grey, self._kernel(observation)), observation)
        return tuple(found)

    def _kernel(self, observation: Observation) -> int:
        """Size of a median that removes leaves and flakes but keeps the marker's cells."""
        height = max(0.5, float(observation.position_m[2]))
        cell_px = self._camera.focal_px * self._side_m / height / CELLS
        return min(11, max(3, 2 * int(MEDIAN_SHARE * cell_px / 2) + 1))

    def _find(self, grey: NDArray[Any], observation: Observation) -> list[Detection]:
        corners, ids, _ = self._detector.detectMarkers(grey)
        found = []
        # OpenCV gives None, not an empty array, where it finds nothing.
        numbers = () if not len(corners) else ids.ravel()
        for quad, marker_id in zip(corners, numbers, strict=True):
            position = self._place(np.asarray(quad, np.float32).reshape(4, 2), observation)
            if position is not None:
                found.append(
                    Detection(
                        marker_id=int(marker_id),
                        confidence=1.0,
                        position_m=position,
                        corners_px=tuple((float(u), float(v)) for u, v in quad.reshape(4, 2)),
                    )
                )
        return found

    def _place(
        self, quad: NDArray[np.float32], observation: Observation
    ) -> tuple[float, float, float] | None:
        ok, turn, shift = cv2.solvePnP(
            self._corners, quad, self._camera.matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
        if not ok:
            return None
        back, _ = cv2.projectPoints(self._corners, turn, shift, self._camera.matrix, None)
        if np.abs(back.reshape(4, 2) - quad).max() > MAX_REPROJECTION_PX:
            return None
        in_body = _CAMERA_FROM_BODY.T @ shift.ravel()
        offset = rotation_matrix(observation.attitude) @ in_body
        height = float(observation.position_m[2])
        if abs(-offset[2] - height) > HEIGHT_TOLERANCE * height + 0.3:
            return None
        # The altimeter knows the height better than a few pixels do: keep the direction of
        # the ray and let it end on the ground.
        scale = height / -offset[2]
        x, y = observation.position_m[:2] + scale * offset[:2]
        return float(x), float(y), 0.0


def rotation_matrix(attitude: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix (3, 3) of a quaternion x, y, z, w."""
    x, y, z, w = attitude
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
