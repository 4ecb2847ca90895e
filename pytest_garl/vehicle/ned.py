"""Frames of ArduPilot's messages: north, east, down; forward, right, down; degrees on a globe.

The simulator has east, north, up, and a body of forward, left, up.
"""

from __future__ import annotations

import math

from pytest_garl.vehicle.rotations import Quaternion, Vector

EARTH_RADIUS_M = 6_378_137.0
ORIGIN_DEG = (47.0, 8.0)
"""Latitude and longitude of the map's centre: any place that is not near a pole."""
GROUND_AMSL_M = 584.0
"""Height of the map's ground above the sea: that of ArduPilot's simulated airfield."""


def turned(v: Vector) -> Vector:
    """Return a vector of the other frame: ENU as NED, and NED as ENU."""
    return v[1], v[0], -v[2]


def flipped(v: Vector) -> Vector:
    """Return a vector of the body's other frame: forward, left, up as forward, right, down."""
    return v[0], -v[1], -v[2]


def heading_of(yaw_rad: float) -> float:
    """Return the other angle: from north clockwise, or from east counter-clockwise; -pi to pi."""
    return math.remainder(math.pi / 2 - yaw_rad, math.tau)


def euler_of(attitude: Quaternion) -> Vector:
    """Return roll, pitch and yaw of the body, forward-right-down, against north-east-down.

    A positive roll lowers the right side, a positive pitch raises the nose.
    """
    x, y, z, w = attitude
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = -math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, heading_of(yaw)


def on_globe(east_m: float, north_m: float) -> tuple[float, float]:
    """Return latitude and longitude in degrees of a place on the map."""
    lat, lon = ORIGIN_DEG
    return (
        lat + math.degrees(north_m / EARTH_RADIUS_M),
        lon + math.degrees(east_m / (EARTH_RADIUS_M * math.cos(math.radians(lat)))),
    )


def on_map(lat_deg: float, lon_deg: float) -> tuple[float, float]:
    """Return the place (east, north) in metres of a latitude and a longitude."""
    lat, lon = ORIGIN_DEG
    north = math.radians(lat_deg - lat) * EARTH_RADIUS_M
    east = math.radians(lon_deg - lon) * EARTH_RADIUS_M * math.cos(math.radians(lat))
    return east, north
