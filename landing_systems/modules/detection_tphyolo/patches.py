"""Cut-outs of markers at one scale, for the classifier of ids."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

PATCH_PX = 40
REACH = 1.6
"""Side of a patch in marker sides: the diagonal of a turned marker and a little more."""
PADDING = 114
"""The grey of what lies outside a picture, as in YOLOv5."""
_LEAST_SPREAD = 3.0
"""Grey levels: what varies less is noise, and shall not be blown up to look like a marker."""


def patch(
    image: NDArray[np.uint8], centre_px: Sequence[float], side_px: float, turn_rad: float = 0.0
) -> NDArray[np.uint8]:
    """Return the square about a marker of ``side_px`` at ``centre_px`` (pixel edges)."""
    scale = PATCH_PX / (REACH * side_px)
    cos, sin = scale * np.cos(turn_rad), scale * np.sin(turn_rad)
    u, v = centre_px[0] - 0.5, centre_px[1] - 0.5
    middle = (PATCH_PX - 1) / 2
    turn = np.array(
        [[cos, -sin, middle - cos * u + sin * v], [sin, cos, middle - sin * u - cos * v]]
    )
    grey = (PADDING, PADDING, PADDING)
    return np.asarray(cv2.warpAffine(image, turn, (PATCH_PX, PATCH_PX), borderValue=grey), np.uint8)


def normalised(patches: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return patches (n, P, P, 3) as (n, 3, P, P) of mean 0 and spread 1: fog and night away."""
    values = patches.astype(np.float32).transpose(0, 3, 1, 2)
    values = values - values.mean(axis=(1, 2, 3), keepdims=True)
    spread = np.maximum(values.std(axis=(1, 2, 3), keepdims=True), _LEAST_SPREAD)
    result: NDArray[np.float32] = values / spread
    return result
