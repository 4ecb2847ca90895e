"""What a director of events knows of a landing, and the director that decides by learned weights.

Every half second it gets a few numbers about the UAV, and answers for each event that waits: wait,
or strike now.  It is an adversary that watches as a chasing NPC does: where the UAV is and how it
moves it knows half a second late, the moments of the landing and whether the marker can be read at
once.  It never knows what the landing system believes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Sequence

import numpy as np

from pytest_garl.npcs.director import (
    MOVES_MPS,
    REMEMBERED,
    SCALE_M,
    SCALE_MPS,
    Features,
    LearnedDirector,
    Valued,
)
from pytest_garl.scenarios.groups import EVENTS, MOMENTS
from pytest_garl.simulation.npc_policy import Outlook

STRIKING = "striking"
"""The name of these inputs, those of a director of events."""
LONG_S = 10.0
"""Times are shares of this, at most 1: most of what a descent does takes less."""
EVENT_FEATURES = (
    "always",
    *(f"passed_{moment.replace(' ', '_')}" for moment in MOMENTS[1:]),
    *(f"since_{moment.replace(' ', '_')}" for moment in MOMENTS[1:]),
    "since_start",
    "height",
    "climb",
    "speed",
    "from_marker",
    "readable",
    "for",
    "held",
)
"""The numbers about a UAV.

``passed`` is 1 from a moment of the landing on, ``since`` how long ago that was.  ``height`` and
``from_marker``, the horizontal distance, are in tens of metres, ``climb`` and the horizontal
``speed`` in 3 m/s.  ``readable`` is 1 if the marker could be read in the latest picture, ``for``
how long that has not changed, and ``held`` the share of the last five seconds in which the UAV
neither climbed nor sank.
"""
AT = {name: index for index, name in enumerate(EVENT_FEATURES)}
EVENT_INPUTS = len(EVENTS) * len(EVENT_FEATURES)
"""A network has inputs for each kind of event, so that each has weights of its own."""


class EventWatch:
    """Turns what is shown of one flight, decision after decision, into numbers."""

    def __init__(self) -> None:
        self._before: Outlook | None = None
        self._climbs: deque[float] = deque(maxlen=REMEMBERED)
        self._readable, self._since_s = False, 0.0

    def look(self, outlook: Outlook) -> Features:
        """Take in the next decision; return the numbers of :data:`EVENT_FEATURES`."""
        now = outlook.time_s
        if outlook.is_readable != self._readable:
            self._readable, self._since_s = outlook.is_readable, now
        seen, self._before = self._before or outlook, outlook
        vx, vy, climb = seen.uav_velocity_mps
        self._climbs.append(climb)
        passed = [float(math.isfinite(each)) for each in outlook.moments_s[1:]]
        since = [_share(now - each) for each in outlook.moments_s[1:]]
        return np.array(
            [
                1.0,
                *passed,
                *since,
                _share(now),
                min(2.0, seen.uav_position_m[2] / SCALE_M),
                climb / SCALE_MPS,
                math.hypot(vx, vy) / SCALE_MPS,
                min(2.0, math.dist(seen.uav_position_m[:2], seen.marker_position_m) / SCALE_M),
                float(outlook.is_readable),
                _share(now - self._since_s),
                sum(abs(each) <= MOVES_MPS for each in self._climbs) / len(self._climbs),
            ]
        )


def _share(seconds: float) -> float:
    """Return a time as a share; 0 before a moment that has not come."""
    return min(1.0, seconds / LONG_S) if seconds >= 0 else 0.0


def inputs(rows: Features, event: str) -> Features:
    """Return numbers (n, features) as a network's inputs (n, inputs) about a kind of event."""
    count = len(EVENT_FEATURES)
    first = EVENTS.index(event) * count
    found = np.zeros((len(rows), EVENT_INPUTS))
    found[:, first : first + count] = rows
    return found


class LearnedStrikes:
    """Decides in one flight when events strike, by a network's values of wait and strike."""

    def __init__(self, network: Valued) -> None:
        self._director, self._watch = LearnedDirector(network=network), EventWatch()

    def strikes(self, outlook: Outlook, waiting: Sequence[str]) -> Collection[str]:
        """Return which of the events that wait strike now."""
        row = self._watch.look(outlook)[None, :]
        return [each for each in waiting if self._director.decides(inputs(row, each)[0])]
