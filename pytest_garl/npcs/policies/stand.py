"""stand: an NPC walks to the marker and stands on it."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.npcs.steering import towards
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Move, Situation


class Stand:
    """Walks to the marker and stands on it."""

    reads_uav = False

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Do nothing."""

    def decide(self, situation: Situation) -> Move:
        """Go to the marker, slow down over the last step, and stay."""
        goal = situation.marker_position_m
        stride = situation.self.speed_mps * DECISION_STEP_S
        distance = math.dist(situation.self.position_m[:2], goal)
        move = towards(goal, situation)
        share = min(1.0, distance / stride) if stride > 0 else 0.0
        return Move(x=share * move.x, y=share * move.y)


POLICY = Stand
