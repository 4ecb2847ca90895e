"""From pixels of a lens that distorts to those of a pinhole."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl import Camera


def undistorted(pixels: NDArray[Any], camera: Camera) -> NDArray[np.float32]:
    """Return where a pinhole shows the pixels (n, 2), whose centres are at whole numbers."""
    points = np.asarray(pixels, np.float32)
    if not camera.distortion:
        return points
    coefficients = np.array(camera.distortion)
    # More iterations than OpenCV's five, which err by pixels in the corners of a wide lens.
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 50, 1e-6)
    found = cv2.undistortPoints(
        points.reshape(-1, 1, 2),
        camera.matrix,
        coefficients,
        R=np.eye(3),
        P=camera.matrix,
        criteria=criteria,
    )
    return np.asarray(found, np.float32).reshape(-1, 2)
