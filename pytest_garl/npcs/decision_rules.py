"""The rule by which NPCs that perceive the UAV in part go to it."""

from __future__ import annotations

import math

from pytest_garl.npcs.interference import Belief
from pytest_garl.npcs.steering import towards
from pytest_garl.simulation.npc_policy import Move

LATEST_S = 5.0
"""Nobody looks farther ahead."""


class Intercepting:
    """Goes to where the UAV will be when it gets there, if that flies straight on."""

    def decide(self, belief: Belief) -> Move:
        """Return the move straight there."""
        (x, y, _), (vx, vy, _) = belief.uav_position_m, belief.uav_velocity_mps
        distance = math.dist((x, y), belief.self.position_m[:2])
        ahead_s = min(LATEST_S, distance / max(0.1, belief.self.speed_mps))
        return towards((x + vx * ahead_s, y + vy * ahead_s), belief)
