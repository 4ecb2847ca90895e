"""Lens distortion: from where a pinhole shows a place to where a lens shows it, and back.

The model and its coefficients k1, k2, p1, p2[, k3[, k4, k5, k6]] are those of OpenCV's calibration
(documentation of the module calib3d).  Places are coordinates on the image plane at a distance of
1, x to the right and y down.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
COUNTS = (4, 5, 8)
"""Numbers of coefficients that there are models for."""
LEAST_SCALE = 0.05
"""A lens may shrink the picture at its edge to this share, and not fold it."""
_STEPS, _ITERATIONS = 16, 4


def distorted(points: Array, coefficients: Sequence[float]) -> Array:
    """Return where a lens shows the places (n, 2) of a pinhole, shape (n, 2)."""
    return _model(points, coefficients)[0]


def undistorted(points: Array, coefficients: Sequence[float]) -> Array | None:
    """Return the places (n, 2) of a pinhole that a lens shows at ``points`` (n, 2).

    None if the lens shows no place there, or several: if the model folds back between the middle
    and one of the points.  Newton's method, from the middle outwards.
    """
    # Newton's method goes anywhere once the model has folded back: that is found below.
    with np.errstate(all="ignore"):
        found = np.zeros_like(points)
        for step in range(1, _STEPS + 1):
            wanted = points * (step / _STEPS)
            for _ in range(_ITERATIONS):
                shown, (xx, xy, yx, yy) = _model(found, coefficients)
                area = xx * yy - xy * yx
                if not (area > LEAST_SCALE**2).all():
                    return None
                dx, dy = (wanted - shown).T
                move = np.stack([yy * dx - xy * dy, xx * dy - yx * dx], axis=1)
                found = found + move / area[:, None]
        left = np.abs(_model(found, coefficients)[0] - points).max()
    return found if left < 1e-9 else None


def _model(
    points: Array, coefficients: Sequence[float]
) -> tuple[Array, tuple[Array, Array, Array, Array]]:
    """Return the distorted places, and the derivatives dx'/dx, dx'/dy, dy'/dx, dy'/dy."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    x, y = points.T
    r2 = x * x + y * y
    above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    # By r2.
    slope = (k1 + r2 * (2 * k2 + r2 * 3 * k3)) - radial * (k4 + r2 * (2 * k5 + r2 * 3 * k6))
    slope = slope / below
    shown = np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=1,
    )
    cross = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
    return shown, (
        radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x,
        cross,
        cross,
        radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x,
    )
