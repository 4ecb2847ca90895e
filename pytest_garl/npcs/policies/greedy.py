"""greedy: an NPC walks over the marker again and again."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.npcs.steering import towards
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Move, Situation


class Greedy:
    """Walks across the marker, turns, and walks across it again, without a stop.

    A baseline for learned policies: it causes most of the violations that they cause.
    """

    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Start towards the marker."""
        self._move = towards(situation.marker_position_m, situation)

    def decide(self, situation: Situation) -> Move:
        """Go straight to the marker, and one decision beyond it."""
        stride = situation.self.speed_mps * DECISION_STEP_S
        if math.dist(situation.self.position_m[:2], situation.marker_position_m) > stride:
            self._move = towards(situation.marker_position_m, situation)
        return self._move


POLICY = Greedy
