"""Values of Foxglove's messages, made from those of a flight."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from foxglove import Schema
from foxglove.messages import Color, Point2, Point3, Pose, Quaternion, Timestamp, Vector3

WORLD, UAV_FRAME, CAMERA_FRAME = "world", "uav", "camera"
"""Names of the frames; an object's frame has the object's name."""
IDENTITY = (0.0, 0.0, 0.0, 1.0)
_NS = 1_000_000_000


class Message(Protocol):
    """What is written: bytes, and the schema that tells how to read them."""

    def get_schema(self) -> Schema:
        """Return the schema of all messages of its kind."""
        ...

    def encode(self) -> bytes:
        """Return the message in protobuf's encoding."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Logged:
    """A message of a topic at a time, in nanoseconds of simulated time."""

    time_ns: int
    topic: str
    message: Message


def ns(time_s: float) -> int:
    """Return a time in nanoseconds."""
    return round(time_s * _NS)


def stamp(time_ns: int) -> Timestamp:
    """Return a time as messages hold it."""
    return Timestamp(sec=time_ns // _NS, nsec=time_ns % _NS)


def colour(rgb: Sequence[float], opacity: float = 1.0) -> Color:
    """Return a colour of red, green and blue from 0 to 255, with an opacity from 0 to 1."""
    r, g, b = (value / 255 for value in rgb)
    return Color(r=r, g=g, b=b, a=opacity)


def vector(values: Iterable[float]) -> Vector3:
    """Return a vector of three numbers."""
    x, y, z = (float(value) for value in values)
    return Vector3(x=x, y=y, z=z)


def point(values: Iterable[float]) -> Point3:
    """Return a point in space."""
    x, y, z = (float(value) for value in values)
    return Point3(x=x, y=y, z=z)


def quaternion(values: Iterable[float]) -> Quaternion:
    """Return a quaternion of x, y, z, w."""
    x, y, z, w = (float(value) for value in values)
    return Quaternion(x=x, y=y, z=z, w=w)


def pose(position_m: Iterable[float], attitude: Iterable[float] = IDENTITY) -> Pose:
    """Return a pose."""
    return Pose(position=vector(position_m), orientation=quaternion(attitude))


def pixel(place_px: Sequence[float]) -> Point2:
    """Return a place in a picture.

    The project counts pixels as OpenCV does, whole numbers at their centres; annotations count from
    the top left corner of the first pixel (Foxglove's documentation of PointsAnnotation).
    """
    return Point2(x=float(place_px[0]) + 0.5, y=float(place_px[1]) + 0.5)
