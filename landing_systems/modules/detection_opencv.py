"""Marker detection with OpenCV's ArUco detector, with the pose from the corners."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.lens import undistorted
from pytest_garl import Camera, Detection, Mission, Observation

CAMERA_FROM_BODY = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Image right is the body's -y, image down its -x, the optical axis its -z."""
LOOKS: tuple[tuple[float, float, float], ...] = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, 3.0),
    (0.3, 0.0, 3.0),
    (0.5, 0.5, 3.0),
)
"""Ways to look at a frame, as sizes in marker cells: of an opening, which removes flakes and
other bright specks; of a closing, which removes leaves and other dark ones; and of the
neighbourhood whose brightest grey counts as white, which removes the edges of shadows."""
SMALLEST_SHARE = 0.4
"""What is smaller than this share of the marker, seen from the height of the search, is noise."""
LARGEST_CELL_PX = 9.0
"""Larger cells are shrunk to this: near the ground as much is found, in half the time."""
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
        parameters.minMarkerPerimeterRate = SMALLEST_SHARE * _perimeter_rate(mission)
        parameters.adaptiveThreshWinSizeMin = 5
        parameters.adaptiveThreshWinSizeMax = 25
        parameters.adaptiveThreshWinSizeStep = 20
        # Leaves and snow on the marker bend its outline and flip its bits.  Correcting as many
        # bits as the dictionary allows lets through a wrong id now and then, which neither the
        # pose nor the agreement of several frames would.
        parameters.polygonalApproxAccuracyRate = 0.06
        parameters.maxErroneousBitsInBorderRate = 0.5
        parameters.errorCorrectionRate = 1.0
        parameters.perspectiveRemovePixelPerCell = 8
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        self._camera: Camera = mission.camera
        self._wanted = mission.marker_id
        self._side_m = mission.marker_side_m
        # The bits and a black border of one cell on each side.
        self._cells = dictionary.markerSize + 2
        self._look = 0
        self._other = 0
        half = mission.marker_side_m / 2
        self._corners = np.array(
            [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]]
        )

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Return all markers in the frame whose pose is plausible.

        The look that found the wanted marker last comes first; where it fails, one of the
        others, in turn, has a try.
        """
        grey = np.asarray(cv2.cvtColor(observation.image, cv2.COLOR_RGB2GRAY))
        height = max(0.5, float(observation.position_m[2]))
        cell_px = self._camera.focal_px * self._side_m / height / self._cells
        scale = min(1.0, LARGEST_CELL_PX / cell_px)
        if scale < 1:
            grey = np.asarray(cv2.resize(grey, None, None, scale, scale, cv2.INTER_AREA))
        cell_px *= scale
        found = self._find(_cleaned(grey, self._look, cell_px), scale, observation)
        if not any(item.marker_id == self._wanted for item in found):
            self._other = (self._other + 1) % len(LOOKS)
            if self._other == self._look:
                self._other = (self._other + 1) % len(LOOKS)
            more = self._find(_cleaned(grey, self._other, cell_px), scale, observation)
            if any(item.marker_id == self._wanted for item in more):
                self._look = self._other
            found += more
        return tuple(found)

    def _find(self, grey: NDArray[Any], scale: float, observation: Observation) -> list[Detection]:
        """Return the markers in a frame that was shrunk by ``scale``."""
        corners, ids, _ = self._detector.detectMarkers(grey)
        found = []
        # OpenCV gives None, not an empty array, where it finds nothing.
        numbers = () if not len(corners) else ids.ravel()
        for quad, marker_id in zip(corners, numbers, strict=True):
            # Pixel centres are at whole numbers, before and after shrinking.
            corners_px = ((np.asarray(quad).reshape(4, 2) + 0.5) / scale - 0.5).astype(np.float32)
            position = self._place(undistorted(corners_px, self._camera), observation)
            if position is not None:
                found.append(
                    Detection(
                        marker_id=int(marker_id),
                        confidence=1.0,
                        position_m=position,
                        corners_px=tuple((float(u), float(v)) for u, v in corners_px),
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
        # The pose of a perfect square has no numbers; no comparison with them holds.
        if not np.abs(back.reshape(4, 2) - quad).max() <= MAX_REPROJECTION_PX:
            return None
        in_body = CAMERA_FROM_BODY.T @ shift.ravel()
        offset = rotation_matrix(observation.attitude) @ in_body
        height = float(observation.position_m[2])
        if abs(-offset[2] - height) > HEIGHT_TOLERANCE * height + 0.3:
            return None
        # The altimeter knows the height better than a few pixels do: keep the direction of
        # the ray and let it end on the ground.
        scale = height / -offset[2]
        x, y = observation.position_m[:2] + scale * offset[:2]
        return float(x), float(y), 0.0


def _perimeter_rate(mission: Mission) -> float:
    """Return the marker's perimeter in pixels over the frame's longer side, as searched for."""
    camera = mission.camera
    side_px = camera.focal_px * mission.marker_side_m / mission.search_altitude_m
    return 4 * side_px / max(camera.width_px, camera.height_px)


def _cleaned(grey: NDArray[Any], look: int, cell_px: float) -> NDArray[Any]:
    """Prepare a frame in which the marker's cells are ``cell_px`` wide."""
    opening, closing, white = LOOKS[look]
    if opening:
        grey = _morphology(grey, cv2.MORPH_OPEN, opening * cell_px)
    if closing:
        grey = _morphology(grey, cv2.MORPH_CLOSE, closing * cell_px)
    if white:
        lightest = _morphology(grey, cv2.MORPH_CLOSE, white * cell_px)
        grey = np.asarray(cv2.divide(grey, lightest, scale=255))
    return grey


def _morphology(grey: NDArray[Any], operation: int, size_px: float) -> NDArray[Any]:
    size = min(151, max(3, 2 * int(size_px / 2) + 1))
    return np.asarray(cv2.morphologyEx(grey, operation, np.ones((size, size), np.uint8)))


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
