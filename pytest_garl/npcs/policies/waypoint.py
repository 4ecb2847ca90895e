"""waypoint: an NPC walks to random places, one after the other."""

from __future__ import annotations

import numpy as np

from pytest_garl.npcs.steering import arrived, towards
from pytest_garl.simulation.npc_policy import Move, Situation


class Waypoint:
    """Walks to a random destination within the map's bounds, then to the next.

    The paper's random baseline: "dynamic objects' start positions and destinations are
    generated randomly within the specified map range".
    """

    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Draw the first destination."""
        self._rng = rng
        self._draw(situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight towards the destination."""
        if arrived(self._goal, situation):
            self._draw(situation)
        return towards(self._goal, situation)

    def _draw(self, situation: Situation) -> None:
        x_min, x_max, y_min, y_max = situation.map.bounds_m
        self._goal = (
            float(self._rng.uniform(x_min, x_max)),
            float(self._rng.uniform(y_min, y_max)),
        )


POLICY = Waypoint
