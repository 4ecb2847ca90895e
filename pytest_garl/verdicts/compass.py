"""Directions in words."""

from __future__ import annotations

import math

_POINTS = (
    "east",
    "north-east",
    "north",
    "north-west",
    "west",
    "south-west",
    "south",
    "south-east",
)


def compass_point(east_m: float, north_m: float) -> str:
    """Return the nearest of the eight points in the direction of an offset."""
    return _POINTS[round(math.atan2(north_m, east_m) / (math.pi / 4)) % 8]
