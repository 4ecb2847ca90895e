"""The director: decides in flight when an NPC that waits begins its part.

Every half second it gets a few numbers about each thing that still waits and answers wait or go.
After go the NPC does what its grade does from its begin on, so that "go at t" is the same as a
story whose moment is t, and a saved case needs no director.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pytest_garl.npcs.grades import GRADE_LIMITS
from pytest_garl.npcs.interference import Perception, Sighting
from pytest_garl.scenarios.groups import DESCENT
from pytest_garl.scenarios.story import LIMITS_S, Story, story_of
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, NpcState, Situation

Features = NDArray[np.float64]

WAITING = "waiting"
"""The name of these inputs in the manifest of a network."""
KINDS = ("person", "child", "dog", "bird")
GRADES = ("curious", "chasing")
"""The grades whose begin a director decides: those that see the UAV in part."""
REMEMBERED = 10
"""The last decisions whose climbing and holding the director knows: five seconds."""
MOVES_MPS = 0.2
"""A UAV that climbs or sinks faster than this does so on purpose."""
LIMIT = 5.0
"""Bound of every number."""
FEATURES = (
    "sees",
    "distance",
    "from_marker",
    "uav_from_marker",
    "height",
    "climb",
    "approach",
    "speed",
    "top",
    "bottom",
    "spare",
    "lasts",
    "since_start",
    "since_sight",
    *(f"since_{phase.replace(' ', '_')}" for phase in DESCENT[1:]),
    "climbed",
    "held",
    *KINDS,
    *GRADES,
)
"""The numbers about an NPC that waits, in the order of a network's inputs.

All about the UAV is what the NPC believes; 0 if it never saw it.  ``distance`` to its column,
``from_marker`` and ``uav_from_marker`` are in tens of metres, ``height`` as well; ``climb`` and
``approach``, the UAV's speed towards the NPC, in 3 m/s; ``speed`` is the NPC's, in 8 m/s; ``top``
and ``bottom`` its heights in 3 m.  ``spare`` is by how much the UAV needs longer down to the NPC's
top than the NPC to the UAV's column, in 5 s; ``lasts`` how long it will interfere, in 5 s.  Times
since the start, the first sight and the moments of the descent, for which any story may wait, are
shares of :data:`LONG_S`; 0 before.  ``climbed`` and ``held`` are shares of the last decisions in
which the UAV climbed, or neither climbed nor sank.
"""
AT = {name: index for index, name in enumerate(FEATURES)}
SCALE_M, SCALE_MPS, SPEED_MPS, BODY_M, SCALE_S, LONG_S = 10.0, 3.0, 8.0, 3.0, 5.0, 20.0
SLOWEST_MPS = 0.2
"""A UAV that does not sink counts as sinking at this speed, which is never in time."""

NEAR_M = 3.0
"""A UAV that is farther from the marker still flies in."""


class Watch:
    """What one NPC that waits knows of the UAV, as the numbers that a director decides on.

    Raises ValueError if its story has no grade of :data:`GRADES`.
    """

    def __init__(self, situation: Situation, story: Story | None = None) -> None:
        found = story or story_of(situation.scenario, situation.self.name)
        if found is None or found.grade not in GRADES:
            raise ValueError(
                f"{situation.self.name}: found {found and found.grade!r}, expected an NPC whose "
                f"story is of one of the grades {', '.join(GRADES)}"
            )
        self._story = found
        self._lasts_s = min(found.lasts_s, LIMITS_S[found.grade])
        self._perception = Perception(GRADE_LIMITS[found.grade], situation.map)
        self._last: Sighting | None = None
        self._first_s = math.inf
        self._climbs: deque[float] = deque(maxlen=REMEMBERED)

    def look(self, situation: Situation) -> Features:
        """Take in the situation of a decision; return the numbers of :data:`FEATURES`."""
        self._perception.update(situation)
        sighting = self._perception.sighting
        row = np.zeros(len(FEATURES))
        me, now = situation.self, situation.time_s
        if sighting is not None:
            self._first_s = min(self._first_s, now)
            self._climbs.append(sighting.velocity_mps[2])
            for name, value in _of_the_uav(sighting, situation).items():
                row[AT[name]] = value
        values = {
            "from_marker": math.dist(me.position_m[:2], situation.marker_position_m) / SCALE_M,
            "speed": me.speed_mps / SPEED_MPS,
            "top": me.top_m / BODY_M,
            "bottom": me.bottom_m / BODY_M,
            "lasts": self._lasts_s / SCALE_S,
            "since_start": now / LONG_S,
            "since_sight": _since(self._first_s, now),
            "climbed": _share(self._climbs, above=MOVES_MPS),
            "held": _share(self._climbs, above=-MOVES_MPS) - _share(self._climbs, above=MOVES_MPS),
            me.type.name: 1.0,
            self._story.grade: 1.0,
        }
        for phase, began_s in zip(DESCENT[1:], situation.moments_s[1:], strict=False):
            values[f"since_{phase.replace(' ', '_')}"] = _since(began_s, now)
        for name, value in values.items():
            if name in AT:
                row[AT[name]] = value
        return np.clip(row, -LIMIT, LIMIT)


def _of_the_uav(sighting: Sighting, situation: Situation) -> dict[str, float]:
    (x, y), (ux, uy) = situation.self.position_m[:2], sighting.place_m
    vx, vy, climb = sighting.velocity_mps
    distance = math.dist((x, y), (ux, uy))
    nearer = ((x - ux) * vx + (y - uy) * vy) / distance if distance > 0 else 0.0
    return {
        "sees": 1.0,
        "distance": distance / SCALE_M,
        "uav_from_marker": math.dist((ux, uy), situation.marker_position_m) / SCALE_M,
        "height": sighting.height_m / SCALE_M,
        "climb": climb / SCALE_MPS,
        "approach": nearer / SCALE_MPS,
        "spare": spare_s(sighting.height_m, climb, distance, situation.self) / SCALE_S,
    }


def spare_s(height_m: float, climb_mps: float, distance_m: float, me: NpcState) -> float:
    """Return by how much a UAV needs longer down to an NPC's top than the NPC to its column."""
    sinks_s = (height_m - me.top_m) / max(SLOWEST_MPS, -climb_mps)
    return sinks_s - distance_m / max(0.1, me.speed_mps)


def _since(began_s: float, now: float) -> float:
    """Return a time since a moment as a number: above 0 from that moment on."""
    return 0.0 if now < began_s else (now - began_s + DECISION_STEP_S) / LONG_S


def _share(climbs: deque[float], above: float) -> float:
    return sum(climb > above for climb in climbs) / len(climbs) if climbs else 0.0


class Director(Protocol):
    """Decides for one thing that waits, from its numbers at a decision."""

    def decides(self, features: Features) -> bool:
        """Return whether it goes now."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeToGo:
    """The rule to beat: an NPC goes when it can meet the UAV in time.

    It goes as soon as the UAV above the marker is ``margin_s`` from being too low: when it sinks to
    the NPC's top no later than the NPC gets to its column plus the margin.  One that does not see
    the UAV goes ``unseen_s`` after the UAV sank to 3 m.
    """

    margin_s: float = 0.0
    unseen_s: float = 0.0

    NEAR_M = 3.0
    """The rule waits for a UAV that flies in: it is farther than this from the marker."""

    def decides(self, features: Features) -> bool:
        """Return whether the NPC goes now."""
        low_since = features[AT["since_3_m"]] * LONG_S - DECISION_STEP_S
        if not features[AT["sees"]]:
            return bool(low_since >= self.unseen_s - 1e-6)
        if features[AT["uav_from_marker"]] * SCALE_M > NEAR_M:
            return False
        sinks = features[AT["climb"]] * SCALE_MPS < -MOVES_MPS
        return bool((sinks or low_since >= 0) and features[AT["spare"]] * SCALE_S <= self.margin_s)


class Valued(Protocol):
    """What gives the values of wait and go, such as a network."""

    def values(self, state: Features) -> Features:
        """Return the value of each action, (2,)."""


RULE = TimeToGo(margin_s=1.0)
"""The rule that a director must beat, in the summary and for the judges: an NPC is there a second
before the UAV.  With this margin most of them met the UAV after it had seen them, in recorded
flights of three landing systems (``python -m lab.judges margin`` of commit 3b6029a)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedDirector:
    """Goes if the network's second value, that of go, is above the first one, that of wait."""

    network: Valued

    def decides(self, features: Features) -> bool:
        """Return whether the NPC goes now."""
        wait, go = self.network.values(features)
        return bool(go > wait)
