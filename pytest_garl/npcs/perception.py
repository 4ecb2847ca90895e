"""What an NPC perceives of the UAV: late, from near, and only with a free line of sight."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from pytest_garl.npcs.grades import GradeLimits
from pytest_garl.scenarios.bodies import Disc, discs_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Situation

Vector = tuple[float, float, float]


class Sighting(NamedTuple):
    """Place and velocity of the UAV as an NPC perceived it; ``age_s`` is how long ago that was."""

    position_m: Vector
    velocity_mps: Vector
    age_s: float

    @property
    def place_m(self) -> tuple[float, float]:
        """Where the NPC believes the UAV to be: straight on from where it saw it."""
        (x, y, _), (vx, vy, _) = self.position_m, self.velocity_mps
        return x + vx * self.age_s, y + vy * self.age_s

    @property
    def height_m(self) -> float:
        """How high the NPC believes the UAV to fly."""
        return max(0.0, self.position_m[2] + self.velocity_mps[2] * self.age_s)


class Perception:
    """The UAV as one NPC perceives it; show it every situation of a decision."""

    def __init__(self, limits: GradeLimits, map: Map) -> None:
        self._limits = limits
        self._discs = tuple(disc for body in map.bodies for disc in discs_of(body))
        late = round(limits.delay_s / DECISION_STEP_S)
        self._seen: deque[tuple[Vector, Vector] | None] = deque(maxlen=late + 1)

    def take_in(self, situation: Situation) -> None:
        """Look at the UAV."""
        found = None
        if self._is_in_sight(situation):
            found = (situation.uav_position_m, situation.uav_velocity_mps)
        self._seen.append(found)

    @property
    def sighting(self) -> Sighting | None:
        """What has reached the NPC's mind; None if it saw nothing at that moment."""
        if len(self._seen) < (self._seen.maxlen or 1) or self._seen[0] is None:
            return None
        position, velocity = self._seen[0]
        return Sighting(position, velocity, self._limits.delay_s)

    def _is_in_sight(self, situation: Situation) -> bool:
        x, y, z = situation.self.position_m
        # From the eyes, near its highest point.
        eye = (x, y, max(z, situation.self.top_m - 0.1))
        if math.dist(eye, situation.uav_position_m) > self._limits.sees_within_m:
            return False
        return not any(_stands_between(disc, eye, situation.uav_position_m) for disc in self._discs)


def _stands_between(disc: Disc, eye: Vector, thing: Vector) -> bool:
    """Whether the line between two points passes through an upright cylinder."""
    (x, y, z), (dx, dy, dz) = eye, tuple(b - a for a, b in zip(eye, thing, strict=True))
    length = dx * dx + dy * dy
    along = ((disc.x_m - x) * dx + (disc.y_m - y) * dy) / length if length > 0 else 0.0
    if not 0 < along < 1:
        return False
    away = math.hypot(x + along * dx - disc.x_m, y + along * dy - disc.y_m)
    return away < disc.radius_m and disc.low_m < z + along * dz < disc.high_m
