"""The estimate of the pad's place, from sightings of single frames."""

from __future__ import annotations

import math
from collections import deque

Place = tuple[float, float]
CONFIRM_COUNT, CONFIRM_WINDOW, CONFIRM_RADIUS_M = 4, 8, 0.7
"""Four of eight frames that agree within 0.7 m are a pad."""
SMOOTHING = 0.35
"""Weight of a new sighting: three frames to follow, enough to average the noise of corners."""
GATE_M = 1.5
"""A sighting farther from the target is another thing, unless several agree."""


class Track:
    """Follows the pad: ``target`` is its place, or None, ``seen_s`` when it was seen last."""

    def __init__(self) -> None:
        self.target: Place | None = None
        self.seen_s = -math.inf
        self.hint: Place | None = None
        self.hint_s = -math.inf
        self._recent: deque[Place | None] = deque(maxlen=CONFIRM_WINDOW)

    def note(self, now: float, spot: Place | None) -> None:
        """Take in the sighting of a frame, None for a frame without one."""
        self._recent.append(spot)
        if spot is None:
            return
        self.hint, self.hint_s = spot, now
        if self.target is not None and math.dist(spot, self.target) <= GATE_M:
            self.target, self.seen_s = self.blended(self.target, spot), now
            return
        agreed = self.agreed()
        if agreed is not None:
            self.target, self.seen_s = agreed, now

    def blended(self, target: Place, spot: Place) -> Place:
        """Return the target after a sighting near it."""
        (x, y), (u, v) = target, spot
        return x + SMOOTHING * (u - x), y + SMOOTHING * (v - y)

    def agreed(self) -> Place | None:
        """Return the middle of the recent sightings if enough of them agree with the last."""
        places = [place for place in self._recent if place is not None]
        near = [each for each in places if math.dist(each, places[-1]) <= CONFIRM_RADIUS_M]
        if len(near) < CONFIRM_COUNT:
            return None
        return sum(x for x, _ in near) / len(near), sum(y for _, y in near) / len(near)

    def forget(self) -> None:
        """Begin anew: the pad is not where it was."""
        self.target = self.hint = None
        self.seen_s = self.hint_s = -math.inf
        self._recent.clear()
