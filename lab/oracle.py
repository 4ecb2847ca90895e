"""An NPC policy written by hand that looks ahead: the rival of learned policies.

``random with lab.oracle:Oracle`` is a method of ``lab.experiment`` that flies random scenarios
among its NPCs.  It knows the true state of everything, how the UAV's descent goes on, and about
when a UAV that watches would notice it.  It waits outside of that range, and goes when its forecast
ends in a collision.  The forecast assumes a UAV that stays in its column: it is no strict bound.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation

STEP_S, HORIZON_S = 0.1, 4.0
WAITS_S = (0.0, 0.5, 1.0)
UAV_RADIUS_M = 0.5
UAV_BOTTOM_M, UAV_TOP_M = 0.24, 0.1
NOTICE_M, NOTICE_S = 2.0, 0.3
CLIMB_MPS2, CLIMB_MPS = 2.0, 1.5
LURK_M = 3.5
HIT_SHARE = 0.8
"""A forecast counts as a hit below this share of the sum of the radii."""
ARRIVE_SHARE = 0.8
"""It lurks as far away as it goes in this share of the time that the UAV needs to come down."""


class Oracle:
    """Goes at the UAV if that hits, waits if going later hits, else keeps its distance."""

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Nothing to prepare."""

    def decide(self, situation: Situation) -> Move:
        """Look three decisions ahead."""
        hits = [wait_s for wait_s in WAITS_S if _hits(situation, wait_s)]
        if hits:
            return _towards_uav(situation, 1.0) if hits[0] == 0 else STAY
        own = situation.self
        fall_m = max(0.0, situation.uav_position_m[2] - UAV_BOTTOM_M - own.top_m)
        fall_s = fall_m / max(0.5, -situation.uav_velocity_mps[2])
        lurk_m = max(LURK_M, ARRIVE_SHARE * own.speed_mps * fall_s)
        too_far_m = math.dist(own.position_m[:2], situation.uav_position_m[:2]) - lurk_m
        stride_m = max(0.1, own.speed_mps * DECISION_STEP_S)
        return _towards_uav(situation, max(-1.0, min(1.0, too_far_m / stride_m)))


def _towards_uav(situation: Situation, share: float) -> Move:
    """Go to where the UAV will be, or away from it if ``share`` is below 0."""
    own, uav = situation.self.position_m[:2], situation.uav_position_m[:2]
    travel_s = min(2.0, math.dist(own, uav) / max(0.3, situation.self.speed_mps))
    x, y = (
        uav[axis] + travel_s * situation.uav_velocity_mps[axis] - own[axis] for axis in range(2)
    )
    length = math.hypot(x, y)
    return Move(x=share * x / length, y=share * y / length) if length > 0 else STAY


def _hits(situation: Situation, wait_s: float) -> bool:
    """Forecast whether a straight run at the UAV, after a wait, ends in a collision."""
    own = situation.self
    height_m, climb_mps = situation.uav_position_m[2], situation.uav_velocity_mps[2]
    gap_m = math.dist(own.position_m[:2], situation.uav_position_m[:2])
    speed_mps = noticed_s = now_s = 0.0
    while now_s < HORIZON_S:
        now_s += STEP_S
        if now_s > wait_s:
            speed_mps = min(own.speed_mps, speed_mps + own.type.acceleration_mps2 * STEP_S)
            gap_m = max(0.0, gap_m - speed_mps * STEP_S)
        below_m = height_m - own.top_m
        if gap_m < NOTICE_M and below_m > 0 and gap_m - own.type.radius_m < below_m:
            noticed_s += STEP_S
        if noticed_s > NOTICE_S:
            climb_mps = min(CLIMB_MPS, climb_mps + CLIMB_MPS2 * STEP_S)
        height_m = max(UAV_BOTTOM_M, height_m + climb_mps * STEP_S)
        level = height_m - UAV_BOTTOM_M < own.top_m and height_m + UAV_TOP_M > own.bottom_m
        if level and gap_m < HIT_SHARE * (UAV_RADIUS_M + own.type.radius_m):
            return True
    return False
