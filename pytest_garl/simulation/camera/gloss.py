"""The sun's reflection on wet ground."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.weather import Conditions

SPECULAR_RADIUS = 0.10
"""Half-width, as a tangent, of the sun's smeared reflection on a wet rough ground:
engineering estimate."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gloss:
    """The sun's reflection: its grey levels in the middle, its middle and width in pixels."""

    strength: float
    centre_px: tuple[float, float]
    sigma_px: float


def gloss_of(view: View, conditions: Conditions, focal_px: float) -> Gloss | None:
    """Return the sun's reflection on wet ground, where the mirrored ray meets the sun."""
    strength = 230.0 * conditions.wetness * conditions.direct_share
    if strength < 1:
        return None
    x, y, z = conditions.sun
    mirrored = view.axes @ np.array([x, y, -z])
    if mirrored[2] < 0.3:
        return None
    u, v = (float(value) for value in view.pixels(mirrored[None])[0])
    sigma = SPECULAR_RADIUS * focal_px / float(mirrored[2])
    return Gloss(strength=strength, centre_px=(u, v), sigma_px=sigma)


def add_gloss(image: NDArray[np.uint8], view: View, gloss: Gloss | None) -> None:
    """Add the sun's reflection to a picture, (h, w, 3), in place."""
    if gloss is None:
        return
    (u, v), sigma = gloss.centre_px, gloss.sigma_px
    # Beyond 3.3 sigma 230 levels are less than one.
    centre = np.array([[u, v]], np.float32)
    rows, columns = view.box(np.concatenate([centre - 3.3 * sigma, centre + 3.3 * sigma]))
    part = image[rows, columns]
    if part.size == 0:
        return
    across = np.exp(-(((np.arange(columns.start, columns.stop) - u) / sigma) ** 2) / 2)
    down = np.exp(-(((np.arange(rows.start, rows.stop) - v) / sigma) ** 2) / 2)
    glow = (gloss.strength * np.outer(down, across)).astype(np.uint8)
    cv2.add(part, cv2.cvtColor(glow, cv2.COLOR_GRAY2RGB), part)
