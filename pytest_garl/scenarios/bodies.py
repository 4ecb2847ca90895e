"""Solid bodies made of parts; the physics and the camera use the same parts."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Shape = Literal["box", "cylinder", "sphere", "ellipsoid"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One convex primitive of a body.

    ``size_m`` is the full extents (x, y, z) of every shape.  A cylinder's axis is its own z
    axis, and x = y = diameter; the three extents of a sphere are equal.
    ``position_m`` is the part's centre in the body's frame, ``rotation`` the quaternion
    (x, y, z, w) that turns the part's axes into the body's; ``colour`` is RGB 0-255.
    """

    shape: Shape
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    colour: tuple[int, int, int] = (128, 128, 128)


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A named solid of several parts; ``kind`` is its common name (tree, bench, dog).

    ``position_m`` places the body's frame (on the ground, z up) in the world;
    ``yaw_rad`` turns it about z.  Static bodies stay there.  The simulator moves the body of a
    dynamic object, which faces along +x of its own frame.
    """

    name: str
    kind: str
    parts: tuple[Part, ...]
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0


def quaternion_of(
    *, pitch_rad: float = 0.0, yaw_rad: float = 0.0
) -> tuple[float, float, float, float]:
    """Return the quaternion that first pitches about +y (z towards +x), then yaws about +z."""
    sin_p, cos_p = math.sin(pitch_rad / 2), math.cos(pitch_rad / 2)
    sin_y, cos_y = math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)
    return (-sin_y * sin_p, cos_y * sin_p, sin_y * cos_p, cos_y * cos_p)


def rotate(
    quaternion: tuple[float, float, float, float], vector: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Turn a vector by a quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    vx, vy, vz = vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Disc:
    """The bounding disc of a part seen from above, with its range of heights."""

    name: str
    x_m: float
    y_m: float
    radius_m: float
    low_m: float
    high_m: float


@functools.lru_cache(maxsize=512)
def discs_of(body: Body) -> tuple[Disc, ...]:
    """Return discs that cover the body's parts; long parts are cut into several."""
    return tuple(disc for part in body.parts for disc in _discs(body, part))


def _discs(body: Body, part: Part) -> Iterable[Disc]:
    axis = max(range(3), key=lambda index: part.size_m[index])
    length = part.size_m[axis]
    others = [part.size_m[index] for index in range(3) if index != axis]
    thickness = math.hypot(*others) if part.shape == "box" else max(others)
    pieces = max(1, math.ceil(length / max(thickness, 0.2)))
    for piece in range(pieces):
        along = [0.0, 0.0, 0.0]
        along[axis] = length * ((piece + 0.5) / pieces - 0.5)
        dx, dy, dz = rotate(part.rotation, (along[0], along[1], along[2]))
        x, y, z = (part.position_m[0] + dx, part.position_m[1] + dy, part.position_m[2] + dz)
        cos, sin = math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        half = math.hypot(length / pieces, thickness) / 2
        yield Disc(
            name=body.name,
            x_m=body.position_m[0] + cos * x - sin * y,
            y_m=body.position_m[1] + sin * x + cos * y,
            radius_m=half,
            low_m=z - half,
            high_m=z + half,
        )
