"""An NPC policy that looks ahead with the true state: a reference for learned policies.

It knows more than a learned policy: how the UAV's descent goes on, and about when an avoiding UAV
would notice it.  It waits outside of that range and moves when its forecast ends in a collision.
The forecast is simple and assumes a UAV that stays in its column, so it is no strict bound.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.npc_policy import STAY, Move, PolicySpec, Situation

STEP_S = 0.1
HORIZON_S = 4.0
WAITS_S = (0.0, 0.5, 1.0)
UAV_RADIUS_M = 0.5
UAV_BOTTOM_M, UAV_TOP_M = 0.24, 0.1
NOTICE_M = 2.0
NOTICE_S = 0.3
CLIMB_MPS2, CLIMB_MPS = 2.0, 1.5
LURK_M = 3.5
HIT_M = 0.8
"""A forecast counts as a hit below this share of the sum of radii."""


class Oracle:
    """Runs at the UAV if that hits, waits if running later hits, else keeps its distance."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Look three decisions ahead."""
        x, y, _ = situation.self.position_m
        ux, uy, height = situation.uav_position_m
        distance = math.dist((x, y), (ux, uy))
        plans = [wait for wait in WAITS_S if self._hits(situation, wait)]
        if plans:
            return self._towards(situation, 1.0) if plans[0] == 0 else STAY
        top = situation.self.top_m
        # Be as far away as it takes to arrive when the UAV has come down.
        falls_s = max(0.0, height - UAV_BOTTOM_M - top) / max(0.5, -situation.uav_velocity_mps[2])
        wanted = max(LURK_M, 0.8 * situation.self.speed_mps * falls_s)
        error = distance - wanted
        stride = situation.self.speed_mps * 0.5
        return self._towards(situation, max(-1.0, min(1.0, error / max(stride, 0.1))))

    def _towards(self, situation: Situation, share: float) -> Move:
        """Go to where the UAV will be, or (``share`` < 0) away from it."""
        x, y, _ = situation.self.position_m
        ux, uy, _ = situation.uav_position_m
        vx, vy, _ = situation.uav_velocity_mps
        speed = max(0.3, situation.self.speed_mps)
        travel = min(2.0, math.dist((x, y), (ux, uy)) / speed)
        dx, dy = ux + travel * vx - x, uy + travel * vy - y
        length = math.hypot(dx, dy)
        return Move(x=share * dx / length, y=share * dy / length) if length > 0 else STAY

    def _hits(self, situation: Situation, wait_s: float) -> bool:
        """Forecast a straight run at the UAV after a wait."""
        me = situation.self
        top, bottom = me.top_m, me.bottom_m
        ux, uy, height = situation.uav_position_m
        climb = situation.uav_velocity_mps[2]
        gap = math.dist(me.position_m[:2], (ux, uy))
        speed, noticed, now = 0.0, 0.0, 0.0
        while now < HORIZON_S:
            now += STEP_S
            if now > wait_s:
                speed = min(me.speed_mps, speed + me.type.acceleration_mps2 * STEP_S)
                gap = max(0.0, gap - speed * STEP_S)
            below = height - top
            if gap < NOTICE_M and below > 0 and gap - me.type.radius_m < below:
                noticed += STEP_S
            if noticed > NOTICE_S:
                climb = min(CLIMB_MPS, climb + CLIMB_MPS2 * STEP_S)
            height = max(UAV_BOTTOM_M, height + climb * STEP_S)
            level = height - UAV_BOTTOM_M < top and height + UAV_TOP_M > bottom
            if level and gap < HIT_M * (UAV_RADIUS_M + me.type.radius_m):
                return True
        return False


def oracle_spec() -> PolicySpec:
    """Return its specification."""
    return PolicySpec(name="oracle", factory=f"{__name__}:{Oracle.__name__}")
