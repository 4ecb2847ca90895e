"""The sun's way over the day, and how it is written: elevation and azimuth."""

from __future__ import annotations

import math

TWILIGHT_DEG = -6.0
"""Elevation at dawn and dusk: the end of civil twilight (AMS Glossary); darker than that is
night."""
NOON_DEG = 60.0
_ON_THE_WAY_DEG = 0.02
"""Written angles have two decimals; a sun nearer to the day's way than this lies on it."""


def sun_elevation_deg(position: float) -> float:
    """Return the sun's elevation: dawn at 0, noon at 0.5, dusk at 1."""
    return TWILIGHT_DEG + (NOON_DEG - TWILIGHT_DEG) * math.sin(math.pi * position)


def sun_azimuth_deg(position: float) -> float:
    """Return the compass direction of the sun: east at 0, south at 0.5, west at 1."""
    return 90.0 + 180.0 * position


def position_of_elevation(elevation_deg: float) -> float:
    """Return the position in the morning at which the sun has this elevation, 0 to 0.5."""
    share = (elevation_deg - TWILIGHT_DEG) / (NOON_DEG - TWILIGHT_DEG)
    return math.asin(min(1.0, max(0.0, share))) / math.pi


def position_of(elevation_deg: float, azimuth_deg: float) -> tuple[float, float]:
    """Return the position on the day's way, and the turn in degrees that leads off it.

    The inverse of the two functions above for a sun on the day's way, whose turn is 0.
    """
    position = (azimuth_deg - 90.0) / 180.0
    if 0 <= position <= 1 and abs(sun_elevation_deg(position) - elevation_deg) < _ON_THE_WAY_DEG:
        return position, 0.0
    morning = position_of_elevation(elevation_deg)
    position = morning if azimuth_deg % 360.0 <= 180.0 else 1.0 - morning
    return position, math.remainder(azimuth_deg - sun_azimuth_deg(position), 360.0)
