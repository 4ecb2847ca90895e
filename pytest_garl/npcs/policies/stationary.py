"""stationary: an NPC stays where it starts."""

from __future__ import annotations

import numpy as np

from pytest_garl.simulation.npc_policy import STAY, Move, Situation


class Stationary:
    """Stays where it starts."""

    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Do nothing."""

    def decide(self, situation: Situation) -> Move:
        """Stay."""
        return STAY


POLICY = Stationary
