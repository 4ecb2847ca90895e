"""random_walk: an NPC takes random steps."""

from __future__ import annotations

import numpy as np

from pytest_garl.simulation.npc_policy import Move, Situation


class RandomWalk:
    """Takes one of the paper's five actions at random at every decision."""

    reads_uav = False

    _MOVES = ((0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0), (0.0, 0.0))

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Keep the generator."""
        self._rng = rng

    def decide(self, situation: Situation) -> Move:
        """Draw an action."""
        x, y = self._MOVES[int(self._rng.integers(len(self._MOVES)))]
        return Move(x=x, y=y)


POLICY = RandomWalk
