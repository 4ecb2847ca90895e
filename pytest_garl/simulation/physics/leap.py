"""When a dog that chases the UAV leaps at it, and how high it is in the air."""

from __future__ import annotations

import math
from collections import deque

from pytest_garl.flight.thresholds import GRAVITY_MPS2
from pytest_garl.scenarios.placed import PlacedNpc
from pytest_garl.scenarios.story import APPROACH_S

Vector = tuple[float, float, float]

REACTION_S = 0.5
"""It leaps at where the UAV was this long ago: the delay with which a chasing NPC sees."""
LEAPS_FROM_M = 1.0
"""It leaps at a UAV that is at most this far to the side: engineering estimate, a length of its
body."""


class Leap:
    """The leaps of one body: of a dog whose story is to chase, while its story lasts.

    It leaps straight on in the direction and at the speed at which it runs, because nothing turns
    a body in the air, and comes down again after ``2 sqrt(2 h / g)``, 0.9 s for 1 m.
    """

    def __init__(self, dog: PlacedNpc) -> None:
        kind = dog.type
        self._story = dog.story if kind.leap_m > 0 else None
        self._type = kind
        self._seen: deque[tuple[float, Vector]] = deque()
        self._began_s: float | None = None
        self._now_s = 0.0
        self._lift_mps = math.sqrt(2 * GRAVITY_MPS2 * kind.leap_m)

    @property
    def is_airborne(self) -> bool:
        """Whether it is in the air."""
        return self._began_s is not None

    @property
    def height_m(self) -> float:
        """Return how high its feet are above the ground."""
        if self._began_s is None:
            return 0.0
        since_s = self._now_s - self._began_s
        return max(0.0, self._lift_mps * since_s - GRAVITY_MPS2 * since_s**2 / 2)

    def update(
        self,
        time_s: float,
        moments_s: tuple[float, ...],
        place_m: tuple[float, float],
        uav_m: Vector,
    ) -> None:
        """Take in the time and where it and the UAV are; it may leap now, or land."""
        self._now_s = time_s
        if self._story is None or self._story.grade != "chasing":
            return
        self._seen.append((time_s, uav_m))
        while len(self._seen) > 1 and self._seen[1][0] <= time_s - REACTION_S:
            self._seen.popleft()
        if self._began_s is not None:
            if time_s - self._began_s >= 2 * self._lift_mps / GRAVITY_MPS2:
                self._began_s = None
            return
        begins_s = self._story.begins_s(moments_s)
        is_its_time = begins_s <= time_s <= begins_s + APPROACH_S + self._story.lasts_s
        seen_s, seen_m = self._seen[0]
        if is_its_time and seen_s <= time_s - REACTION_S and self._reaches(place_m, seen_m):
            self._began_s = time_s

    def _reaches(self, place_m: tuple[float, float], uav_m: Vector) -> bool:
        is_near = math.dist(place_m, uav_m[:2]) <= LEAPS_FROM_M
        return is_near and uav_m[2] <= self._type.height_m + self._type.leap_m
