"""Faults of avoidance: what is in the way."""

from __future__ import annotations

import dataclasses

import numpy as np

from lab.faults.control import ControlSystem, Vector
from lab.faults.watch import Watch
from pytest_garl import Command, Observation


class NoWatch(ControlSystem):
    """Looks at nothing but the marker.

    The report: a planner for safe landings says that this is no landing, and does nothing.
    """

    def must_wait(self, now: float, at: Vector, target: tuple[float, float]) -> bool:
        """Never wait."""
        return False


class ZeroDepthWatch(Watch):
    """A watch for which a depth of 0 is near."""

    SHARE = 0.05

    def in_the_way(self, observation: Observation) -> bool:
        """Whether depths are short, also those that were not measured."""
        depth = observation.depth_m
        height, width = depth.shape
        below = depth[height // 3 : -height // 3, width // 3 : -width // 3]
        near = below < float(observation.position_m[2]) - 1.0
        missing = float(np.mean(near & (below == 0))) > self.SHARE
        return missing or super().in_the_way(observation)


class ZeroDepth(ControlSystem):
    """Takes a depth of 0, which means no measurement, for an obstacle.

    The report: depth pictures have many zeros where nothing was measured.
    """

    watch_of = ZeroDepthWatch


class NarrowWatch(Watch):
    """A watch of the middle of the picture alone."""

    KEPT = 0.03

    def in_the_way(self, observation: Observation) -> bool:
        """Whether something is straight below."""
        depth = np.zeros_like(observation.depth_m)
        height, width = depth.shape
        rows = slice(round(height * (0.5 - self.KEPT)), round(height * (0.5 + self.KEPT)))
        columns = slice(round(width * (0.5 - self.KEPT)), round(width * (0.5 + self.KEPT)))
        depth[rows, columns] = observation.depth_m[rows, columns]
        return super().in_the_way(dataclasses.replace(observation, depth_m=depth))


class Narrow(ControlSystem):
    """Looks straight below, as a rangefinder does, while its rotors span a metre.

    The report: the distance below comes from an altimeter, which sees nothing beside it.
    """

    watch_of = NarrowWatch


class StopsWatching(ControlSystem):
    """Ignores what comes into the way once it has committed.

    The report: obstacle avoidance ends without setpoints of a planner, and the flight goes on.
    """

    def must_wait(self, now: float, at: Vector, target: tuple[float, float]) -> bool:
        """Wait only before the commitment."""
        return self.phase != "commit" and super().must_wait(now, at, target)


class LowTransit(ControlSystem):
    """Flies to the pad at 4.5 m, below the tops of trees.

    The report: a return altitude that is too low meets trees.
    """

    TOP_M = 4.5

    def decide(self, now: float, at: Vector, since_s: float) -> Command:
        """Fly low."""
        self.top_m = self.TOP_M
        return super().decide(now, at, since_s)
