"""Stays on the ground in a flight's record.

The simulator notes a touchdown whenever the UAV has lost contact for more than a quarter of a
second, which is right for its land detector.  A UAV that holds its place with running motors skips
for seconds at a few centimetres, and that is one stay: it stands, or is dragged.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, Touchdown
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, GRAVITY_MPS2, HARD_TOUCHDOWN_MPS

ON_GROUND_M = 0.02
"""After its first contact with the ground, the UAV counts as on the ground up to this much above
its height at the contact, because it may rebound a little."""
HOP_M = HARD_TOUCHDOWN_MPS**2 / (2 * GRAVITY_MPS2)
"""A UAV whose feet stay below this height, 0.2 m, has not taken off again: motors that stop there
let it fall without a hard touchdown."""
STANDS_S = 1.5
"""From this time after its touchdown on, a UAV stands with running motors.  When a UAV lands, they
stop within 1.4 s (see ``contacts.SETTLING_S``)."""
LEFT_M = 0.1
"""A UAV that is farther than this from where it touched down has begun to move over the ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stay:
    """One stay on the ground, hops included.

    ``touchdowns`` are those of the simulator, in order; ``end_s`` is when the UAV took off again,
    None if it did not; ``left_s`` when it began to move over the ground, None if it did not;
    ``moved_m`` how far it was from its first touchdown at most, until the motors stopped;
    ``farthest_m`` how far from the marker; ``hop_m`` how high it hopped.
    """

    touchdowns: tuple[Touchdown, ...]
    end_s: float | None
    left_s: float | None
    moved_m: float
    farthest_m: float
    hop_m: float

    @property
    def first(self) -> Touchdown:
        """The touchdown with which it began."""
        return self.touchdowns[0]

    @property
    def since_s(self) -> float:
        """When it began."""
        return self.first.time_s

    @property
    def stopped_s(self) -> float | None:
        """When the motors stopped; None if they did not."""
        return self.touchdowns[-1].stopped_s

    def stands_at(self, time_s: float) -> bool:
        """Whether the UAV stands at a time, after its motors ought to have stopped."""
        ended = self.end_s is not None and time_s > self.end_s
        stopped = self.stopped_s is not None and time_s >= self.stopped_s
        return time_s - self.since_s >= STANDS_S and not ended and not stopped


def stays_of(flight: Flight) -> tuple[Stay, ...]:
    """Return the flight's stays on the ground, in order; empty for simulators without touchdowns.

    A hard touchdown ends the flight; it is none.
    """
    found = list(flight.earlier_touchdowns)
    last = flight.contacts[-1] if flight.contacts else None
    hard = flight.outcome == "collision" and last is not None and last.body_class == "ground"
    if flight.touchdown and not hard:
        found.append(flight.touchdown)
    groups: list[list[Touchdown]] = []
    for each in found:
        if groups and _hop_m(flight, groups[-1][-1].time_s, each.time_s) < HOP_M:
            groups[-1].append(each)
        else:
            groups.append([each])
    return tuple(_stay(flight, group) for group in groups)


def _stay(flight: Flight, touchdowns: Sequence[Touchdown]) -> Stay:
    first, last = touchdowns[0], touchdowns[-1]
    track = flight.uav
    end = _take_off(flight, last.time_s)
    until_s = last.stopped_s if last.stopped_s is not None else math.inf
    part = slice(int(np.searchsorted(track.time_s, first.time_s)), end)
    places = track.position_m[part][track.time_s[part] <= until_s]
    moved = np.hypot(*(places[:, :2] - first.position_m[:2]).T)
    away = np.hypot(*(places[:, :2] - flight.marker_position_m).T)
    here = np.flatnonzero(moved <= LEFT_M)
    after = int(here[-1]) + 1 if len(here) else 0
    times = itertools.pairwise(each.time_s for each in touchdowns)
    hops = [_hop_m(flight, from_s, to_s) for from_s, to_s in times]
    return Stay(
        touchdowns=tuple(touchdowns),
        end_s=float(track.time_s[end]) if end < len(track.time_s) else None,
        left_s=float(track.time_s[part][after]) if after < len(moved) else None,
        moved_m=max([*(each.slid_m for each in touchdowns), *moved.tolist()]),
        farthest_m=max([first.distance_m, *away.tolist()]),
        hop_m=max(hops, default=0.0),
    )


def _take_off(flight: Flight, from_s: float) -> int:
    """Return the first sample after a time at which the UAV is no longer on the ground."""
    start = int(np.searchsorted(flight.uav.time_s, from_s))
    high: NDArray[np.bool_] = flight.uav.position_m[start:, 2] - BODY_ABOVE_FEET_M >= HOP_M
    return start + int(np.argmax(high)) if high.any() else len(flight.uav.time_s)


def _hop_m(flight: Flight, from_s: float, to_s: float) -> float:
    """Return the greatest height of the feet between two times."""
    times = flight.uav.time_s
    between = (times >= from_s) & (times <= to_s)
    heights = flight.uav.position_m[between, 2] - BODY_ABOVE_FEET_M
    return float(heights.max(initial=0.0))


def off_in_track(flight: Flight, limit_m: float) -> Touchdown | None:
    """Return the first place on the ground beyond a limit, for simulators without touchdowns.

    The record's contacts hold only the first one with the ground; later ones follow from the
    height.
    """
    first = next((each for each in flight.contacts if each.body_class == "ground"), None)
    if first is None:
        return None
    track = flight.uav
    start = track.index_at(first.time_s)
    # The sample before a contact lies above the ground, the one after it on the ground.
    height = float(track.position_m[start : start + 2, 2].min()) + ON_GROUND_M
    mx, my = flight.marker_position_m
    for index in range(start, len(track.time_s)):
        x, y, z = (float(value) for value in track.position_m[index])
        off_m = math.hypot(x - mx, y - my)
        if (index == start or z <= height) and off_m > limit_m:
            return Touchdown(
                time_s=max(first.time_s, float(track.time_s[index])),
                position_m=(x, y, z),
                distance_m=off_m,
                speed_mps=first.speed_mps,
                tilt_rad=first.tilt_rad,
                on="nothing",
            )
    return None
