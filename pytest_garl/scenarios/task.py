"""The task of a flight as its user states it: which marker lies there, and where the UAV starts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class NestedMarker:
    """A smaller marker in the same plane, centred ``offset_m`` (x, y) from the board's centre."""

    id: int
    side_m: float
    offset_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerSpec:
    """The marker that lies on the ground.

    ``dictionary`` is the name of one of OpenCV's ArUco or AprilTag dictionaries, ``side_m`` the
    length of the black border's outer side.  The default is the paper's (section 4.2).
    """

    dictionary: str = "DICT_5X5_50"
    id: int = 0
    side_m: float = 1.5
    nested: tuple[NestedMarker, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where the flight begins: motors off on the ground at home, or hovering near the marker.

    ``height_m`` and ``offset_m`` (x, y, from the told coordinate) hold for ``hover`` only.
    """

    mode: Literal["ground", "hover"] = "ground"
    height_m: float = 10.0
    offset_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What stays the same in all flights of a test: the marker and the start."""

    marker: MarkerSpec = field(default_factory=MarkerSpec)
    start: Start = field(default_factory=Start)
