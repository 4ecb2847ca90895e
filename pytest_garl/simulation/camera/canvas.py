"""A canvas draws shapes in world coordinates onto an image of the ground."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.fiducial import DICTIONARIES
from pytest_garl.scenarios.placed import MAP_DICTIONARY, Pad

Image = NDArray[np.uint8]
Bounds = tuple[float, float, float, float]
"""A rectangle of ground in metres: x_min, x_max, y_min, y_max."""

WHITE_LEVEL, BLACK_LEVEL = 238.0, 24.0
"""Grey levels of printed white and black in full light: albedos of 0.93 and 0.09, engineering
estimate of a print on matt foil."""
COVER_COLOUR = (92.0, 104.0, 78.0)
"""A tarpaulin of olive green, with an albedo near 0.4; engineering estimate."""
_SHIFT = 4
"""Fractional bits of the coordinates that OpenCV draws at."""


class Canvas:
    """Draws shapes in the world, in metres, onto an image of the ground within ``bounds_m``."""

    def __init__(self, image: Image, bounds_m: Bounds, m_per_px: float) -> None:
        self.image, self.bounds_m, self.m_per_px = image, bounds_m, m_per_px

    def _pixels(self, world: NDArray[np.float64]) -> NDArray[np.int32]:
        pixels = np.empty_like(world)
        pixels[:, 0] = (world[:, 0] - self.bounds_m[0]) / self.m_per_px - 0.5
        pixels[:, 1] = (self.bounds_m[3] - world[:, 1]) / self.m_per_px - 0.5
        fixed: NDArray[np.int32] = np.round(pixels * 2**_SHIFT).astype(np.int32)
        return fixed

    def polygon(self, world: NDArray[np.float64], colour: Sequence[float]) -> None:
        """Fill a polygon (n, 2)."""
        cv2.fillPoly(self.image, [self._pixels(world)], colour, cv2.LINE_AA, _SHIFT)

    def stroke(self, world: NDArray[np.float64], width_m: float, colour: Sequence[float]) -> None:
        """Draw a line of straight pieces through points (n, 2)."""
        for start, end in itertools.pairwise(world):
            along = end - start
            length = float(np.hypot(*along))
            if length > 0:
                side = np.array([-along[1], along[0]]) / length * width_m / 2
                self.polygon(np.array([start + side, end + side, end - side, start - side]), colour)

    def board(self, pad: Pad) -> None:
        """Draw all markers of a pad, later ones over earlier ones."""
        for each in pad.markers:
            self.marker(each.place_m, each.side_m, each.yaw_rad, each.id, each.dictionary)

    def tarpaulin(self, pad: Pad) -> None:
        """Draw what lies over a part of a pad."""
        if pad.covered_share > 0:
            self.polygon(np.array(pad.cover_m), COVER_COLOUR)

    def marker(
        self,
        centre: tuple[float, float],
        side_m: float,
        yaw_rad: float,
        marker_id: int,
        dictionary: str = MAP_DICTIONARY,
    ) -> None:
        """Draw a marker on a white board with a margin of one cell; its top is north at yaw 0."""
        bits = marker_bits(marker_id, dictionary)
        cells = len(bits)
        cell = side_m / cells
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        rotation = np.array([[cos, -sin], [sin, cos]])

        def square(x: float, y: float, width: float) -> NDArray[np.float64]:
            corners = np.array([[x, y], [x + width, y], [x + width, y - width], [x, y - width]])
            world: NDArray[np.float64] = corners @ rotation.T + np.array(centre)
            return world

        board = side_m + 2 * cell
        self.polygon(square(-board / 2, board / 2, board), (WHITE_LEVEL,) * 3)
        self.polygon(square(-side_m / 2, side_m / 2, side_m), (BLACK_LEVEL,) * 3)
        for row in range(cells):
            for column in range(cells):
                if bits[row, column]:
                    x, y = -side_m / 2 + column * cell, side_m / 2 - row * cell
                    self.polygon(square(x, y, cell), (WHITE_LEVEL,) * 3)


@functools.cache
def marker_bits(marker_id: int, dictionary: str = MAP_DICTIONARY) -> NDArray[np.bool_]:
    """Return the cells (n, n) of a marker with its border, 7 for DICT_5X5_50; True is white."""
    cells = DICTIONARIES[dictionary].bits + 2
    family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    image = cv2.aruco.generateImageMarker(family, marker_id, cells, borderBits=1)
    bits: NDArray[np.bool_] = np.asarray(image) > 127
    return bits
