"""Functions that draw lines, areas and texts, and the colours of a video."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]
Point = tuple[float, float]

BACKGROUND, INK, FAINT, RULE = (250, 250, 248), (28, 30, 34), (112, 116, 122), (206, 208, 212)
UAV, VIEW, MARKER = (24, 84, 222), (96, 150, 246), (214, 0, 150)
"""The UAV and its path, the ground in view, the true marker."""
SYSTEM, HIT = (240, 120, 0), (206, 22, 22)
"""What the landing system believes; what the UAV touched."""
OBJECTS: Mapping[str, Colour] = MappingProxyType(
    {"person": (158, 26, 44), "dog": (112, 66, 18), "bird": (0, 112, 122)}
)
"""Colours of the dynamic objects by type; other types are drawn in ``INK``."""
OBSTACLE_PX = 4.0
"""Side of the square that stands for an obstacle which the landing system reports."""
_SHIFT = 4
"""Fractional bits of the coordinates that OpenCV draws at."""


def blank_picture(width: int, height: int) -> Image:
    """Return an empty picture, RGB uint8 (height, width, 3)."""
    return np.full((height, width, 3), BACKGROUND, np.uint8)


def line(
    image: Image,
    points: NDArray[Any],
    colour: Colour,
    thickness: int = 2,
    *,
    closed: bool = False,
) -> None:
    """Draw a line through points (n, 2) in pixels."""
    if len(points) >= 2:
        cv2.polylines(image, [_fixed(points)], closed, colour, thickness, cv2.LINE_AA, _SHIFT)


def area(image: Image, points: NDArray[Any], colour: Colour) -> None:
    """Fill a convex polygon with corners (n, 2) in pixels."""
    cv2.fillConvexPoly(image, _fixed(points), colour, cv2.LINE_AA, _SHIFT)


def square(image: Image, at: Point, side: float, colour: Colour) -> None:
    """Draw a filled square about ``at``."""
    (x, y), half = at, side / 2
    left, right, high, low = x - half, x + half, y - half, y + half
    area(image, np.array([(left, high), (right, high), (right, low), (left, low)]), colour)


def disc(image: Image, at: Point, radius: float, colour: Colour, thickness: int = -1) -> None:
    """Draw a disc, or a circle where ``thickness`` is positive; all lengths are in pixels."""
    x, y = (round(value * 2**_SHIFT) for value in at)
    cv2.circle(image, (x, y), round(radius * 2**_SHIFT), colour, thickness, cv2.LINE_AA, _SHIFT)


def cross(image: Image, at: Point, reach: float, colour: Colour, thickness: int = 3) -> None:
    """Draw a diagonal cross that reaches as many pixels to each side."""
    x, y = at
    for rise in (reach, -reach):
        ends = np.array([[x - reach, y - rise], [x + reach, y + rise]])
        line(image, ends, colour, thickness)


def text(
    image: Image,
    words: str,
    at: Point,
    colour: Colour = INK,
    size: int = 14,
    *,
    bold: bool = False,
    max_width_px: float | None = None,
) -> float:
    """Write words with the baseline's left end at ``at``; return the x coordinate of their end.

    Words wider than ``max_width_px`` are cut and end in an ellipsis.
    """
    if max_width_px is not None:
        words = _cut(words, size, bold, max_width_px)
    x, y = round(at[0]), round(at[1])
    cv2.putText(image, words, (x, y), colour, _font(), size, _weight(bold))
    return x + width_of(words, size, bold=bold)


def label(image: Image, words: str, at: Point, colour: Colour, size: int = 13) -> None:
    """Write readable words on a light background, completely inside the picture."""
    height, width = image.shape[:2]
    wide = width_of(words, size)
    x = round(min(max(at[0], 3), width - wide - 4))
    y = round(min(max(at[1], size + 3), height - 6))
    background = image[y - size - 1 : y + 5, max(0, x - 3) : x + round(wide) + 4]
    background[:] = (background // 4 + np.array(BACKGROUND, np.uint8) // 4 * 3).astype(np.uint8)
    text(image, words, (x, y), colour, size)


@functools.cache
def width_of(words: str, size: int, *, bold: bool = False) -> float:
    """Return the width of written words in pixels."""
    if not words:
        return 0.0
    return float(cv2.getTextSize((0, 0), words, (0, 0), _font(), size, _weight(bold))[2])


def _cut(words: str, size: int, bold: bool, max_width_px: float) -> str:
    if width_of(words, size, bold=bold) <= max_width_px:
        return words
    while words and width_of(words + "…", size, bold=bold) > max_width_px:
        words = words[:-1]
    return words + "…"


def _fixed(points: NDArray[Any]) -> NDArray[np.int32]:
    return np.asarray(np.round(np.asarray(points) * 2.0**_SHIFT), np.int32)


def _weight(bold: bool) -> int:
    return 700 if bold else 400


@functools.cache
def _font() -> cv2.FontFace:
    return cv2.FontFace("sans")
