"""The marker on the ground: its dictionary, id and size, and smaller markers on the same board."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from pytest_garl.errors import ScenarioError, of_a_user
from pytest_garl.messages import listed, shown

__tracebackhide__ = of_a_user


@dataclass(frozen=True, slots=True, kw_only=True)
class Dictionary:
    """A family of markers: ``bits`` are the data modules along a side, ``size`` counts its ids."""

    bits: int
    size: int


_ARUCO = {
    f"DICT_{bits}X{bits}_{size}": Dictionary(bits=bits, size=size)
    for bits in (4, 5, 6, 7)
    for size in (50, 100, 250, 1000)
}
DICTIONARIES: Mapping[str, Dictionary] = {
    **_ARUCO,
    "DICT_ARUCO_ORIGINAL": Dictionary(bits=5, size=1024),
    "DICT_ARUCO_MIP_36h12": Dictionary(bits=6, size=250),
    "DICT_APRILTAG_16h5": Dictionary(bits=4, size=30),
    "DICT_APRILTAG_25h9": Dictionary(bits=5, size=35),
    "DICT_APRILTAG_36h10": Dictionary(bits=6, size=2320),
    "DICT_APRILTAG_36h11": Dictionary(bits=6, size=587),
}
"""OpenCV's dictionaries by its names; a test compares them with ``cv2.aruco``."""
SIDE_M = (0.05, 5.0)
"""Shortest and longest side of a marker: a hand's print on a charging pad, and the largest mat that
the finely painted piece of ground holds."""
FARTHEST_M = 5.0
"""Farthest offset of a smaller marker from the board's centre."""
MOST_NESTED = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class NestedMarker:
    """A smaller marker in the same plane, centred ``offset_m`` (x, y) from the board's centre.

    The offset turns with the board: at zero yaw x is east and y is north.  The marker is of the
    board's dictionary; it is printed over what lies below, with a white margin of one module.
    """

    id: int
    side_m: float
    offset_m: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerSpec:
    """The marker that lies on the ground.

    ``dictionary`` is the name of one of OpenCV's ArUco or AprilTag dictionaries, ``side_m`` the
    length of the black border's outer side; a white margin of one module surrounds it.  ``nested``
    are smaller markers on the same board, for a camera that is too near to see the large one.  The
    default is the paper's (section 4.2).  Raises ScenarioError for a marker that does not exist.
    """

    dictionary: str = "DICT_5X5_50"
    id: int = 0
    side_m: float = 1.5
    nested: tuple[NestedMarker, ...] = ()

    def __post_init__(self) -> None:
        if self.dictionary not in DICTIONARIES:
            raise ScenarioError(
                f"marker: found dictionary = {shown(self.dictionary)}, expected one of "
                f"{listed(DICTIONARIES)}"
            )
        if not isinstance(self.nested, tuple) or len(self.nested) > MOST_NESTED:
            raise ScenarioError(
                f"marker: found nested = {shown(self.nested)}, expected a tuple of at most "
                f"{MOST_NESTED} NestedMarker(id=..., side_m=..., offset_m=(x, y))"
            )
        for name, each in self.named:
            _check(name, each, DICTIONARIES[self.dictionary].size, self.dictionary)
        ids = [each.id for _, each in self.named]
        if len(ids) > len(set(ids)):
            raise ScenarioError(
                f"marker: found the ids {listed(ids)} on one board, expected each id once"
            )

    @property
    def named(self) -> tuple[tuple[str, NestedMarker], ...]:
        """All markers of the board with their names in messages, the main one first."""
        main = NestedMarker(id=self.id, side_m=self.side_m)
        rest = ((f"marker.nested[{number}]", each) for number, each in enumerate(self.nested))
        return (("marker", main), *rest)

    @property
    def markers(self) -> tuple[NestedMarker, ...]:
        """All markers of the board, the main one first."""
        return tuple(each for _, each in self.named)

    @property
    def modules(self) -> int:
        """Modules along a marker's side: the bits and a black border of one on each side."""
        return DICTIONARIES[self.dictionary].bits + 2

    @property
    def half_diagonal_m(self) -> float:
        """Distance from the centre to a corner of the black border."""
        return self.side_m / math.sqrt(2)

    @property
    def reach_m(self) -> float:
        """Distance from the centre to the farthest corner of a white margin."""
        wide = 1 + 2 / self.modules
        return max(
            math.hypot(*each.offset_m) + each.side_m * wide / math.sqrt(2) for each in self.markers
        )


def _check(name: str, marker: NestedMarker, size: int, dictionary: str) -> None:
    if type(marker.id) is not int or not 0 <= marker.id < size:
        raise ScenarioError(
            f"{name}: found id = {shown(marker.id)}, expected a whole number from 0 to {size - 1} "
            f"({dictionary} has {size} markers)"
        )
    if not _within(marker.side_m, *SIDE_M):
        low, high = SIDE_M
        raise ScenarioError(
            f"{name}: found side_m = {shown(marker.side_m)}, expected {low:g} to {high:g} metres"
        )
    offset = marker.offset_m
    if len(offset) != 2 or not all(_within(each, -FARTHEST_M, FARTHEST_M) for each in offset):
        raise ScenarioError(
            f"{name}: found offset_m = {shown(offset)}, expected (x, y) within {FARTHEST_M:g} m"
        )


def _within(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and type(value) is not bool and low <= value <= high


PAPER_MARKER = MarkerSpec()
MARKER_SIDE_M = PAPER_MARKER.side_m
"""Paper, section 4.2: marker of 1.5 m, id 0."""
