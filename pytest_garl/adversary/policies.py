"""Unlearned policies: objects that stand, walk to destinations, or wander."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.simulation.policy import STAY, Move, PolicySpec, Situation

ARRIVED_M = 0.5


class Stationary:
    """Stays where it starts."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Stay."""
        return STAY


class Waypoint:
    """Walks to a destination drawn within the map's bounds, then to the next.

    The paper's random baseline: "dynamic objects' start positions and destinations are
    generated randomly within the specified map range".
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Draw the first destination."""
        self._rng = rng
        self._draw(situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight towards the destination."""
        x, y, _ = situation.self.position_m
        if math.dist((x, y), self._goal) < max(ARRIVED_M, 0.5 * situation.self.speed_mps):
            self._draw(situation)
        dx, dy = self._goal[0] - x, self._goal[1] - y
        length = math.hypot(dx, dy)
        return Move(x=dx / length, y=dy / length) if length > 0 else STAY

    def _draw(self, situation: Situation) -> None:
        x_min, x_max, y_min, y_max = situation.map.bounds_m
        self._goal = (
            float(self._rng.uniform(x_min, x_max)),
            float(self._rng.uniform(y_min, y_max)),
        )


class RandomWalk:
    """Takes one of the paper's five actions at random at every decision."""

    _MOVES = ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0))

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Keep the generator."""
        self._rng = rng

    def decide(self, situation: Situation) -> Move:
        """Draw an action."""
        x, y = self._MOVES[int(self._rng.integers(len(self._MOVES)))]
        return Move(x=x, y=y)


POLICIES: Mapping[str, PolicySpec] = MappingProxyType(
    {
        name: PolicySpec(name=name, factory=f"{__name__}:{factory.__name__}")
        for name, factory in (
            ("stationary", Stationary),
            ("waypoint", Waypoint),
            ("random_walk", RandomWalk),
        )
    }
)


def policy_spec(name: str) -> PolicySpec:
    """Return the specification of a shipped policy; raise GarlError for an unknown name."""
    if name not in POLICIES:
        raise GarlError(f"unknown object policy {name!r}; expected one of {', '.join(POLICIES)}")
    return POLICIES[name]
