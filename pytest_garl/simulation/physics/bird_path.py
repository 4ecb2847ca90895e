"""When a bird of a story comes, from where, and how high it flies."""

from __future__ import annotations

import math

from pytest_garl.scenarios.placed import PlacedNpc
from pytest_garl.scenarios.story import APPROACH_S

Plane = tuple[float, float]

ENTRY_M = 20.0
"""A bird comes from at least this far, out of sight of a camera that looks down from 12 m."""
FAR_AWAY_M = 1000.0
"""Where a bird is before it comes."""
LEAST_HEIGHT_M = 1.0
"""A bird comes down no lower: its wings clear the ground."""
STOOP_SLOPE = 0.6
"""Descent of a stoop per metre: about 30 degrees, an engineering estimate."""


class BirdPath:
    """The part of a bird's way that its story says, and no policy.

    Without a story, and with that of a hostile bird, it is there from the start, at one height.
    """

    def __init__(self, bird: PlacedNpc, marker_m: Plane) -> None:
        self._story, self._type = bird.story, bird.type
        self.waits = self._story is not None and self._story.grade != "hostile"
        self._height_m = height_m = bird.height_m
        self._began_s: float | None = None
        self._now_s = 0.0
        stoop_m = self._story.stoop_m if self._story and self.waits else 0.0
        self.lowest_m = max(min(height_m, LEAST_HEIGHT_M), height_m - stoop_m)
        start, (mx, my) = bird.start_m, marker_m
        dx, dy = self._story.crossing_m if self._story else (0.0, 0.0)
        self._crossing_m = (mx + dx, my + dy)
        away_rad = math.atan2(start[1] - my - dy, start[0] - mx - dx)
        self.course_rad = math.atan2(my + dy - start[1], mx + dx - start[0])
        away_m = max(ENTRY_M, math.dist(start, self._crossing_m))
        self.entry_m = _beyond(self._crossing_m, away_rad, away_m)
        self.far_away_m = _beyond(self._crossing_m, away_rad, FAR_AWAY_M)

    def comes(self, time_s: float, moments_s: tuple[float, ...]) -> bool:
        """Take in the time; return whether the bird comes at this moment."""
        self._now_s = time_s
        if not self.waits or self._story is None or time_s < self._story.begins_s(moments_s):
            return False
        self.waits, self._began_s = False, time_s
        return True

    def height_m(self, place_m: Plane, height_m: float, dt_s: float) -> float:
        """Return the height after ``dt_s``, within what the bird can climb and dive."""
        wanted = self._wanted_height_m(place_m)
        if wanted == height_m:
            return height_m
        down, up = self._type.dive_mps * dt_s, self._type.climb_mps * dt_s
        return height_m + min(up, max(-down, wanted - height_m))

    def _wanted_height_m(self, place_m: Plane) -> float:
        """Return the height that it wants: low where it crosses, or while it interferes."""
        story, began_s = self._story, self._began_s
        if story is None or began_s is None or self.lowest_m == self._height_m:
            return self._height_m
        if story.grade == "careless":
            slope_m = STOOP_SLOPE * math.dist(place_m, self._crossing_m)
            return min(self._height_m, self.lowest_m + slope_m)
        is_over = self._now_s > began_s + APPROACH_S + story.lasts_s
        return self._height_m if is_over else self.lowest_m


def _beyond(place_m: Plane, course_rad: float, distance_m: float) -> Plane:
    x, y = place_m
    return x + distance_m * math.cos(course_rad), y + distance_m * math.sin(course_rad)
