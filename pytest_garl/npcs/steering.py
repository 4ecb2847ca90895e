"""Moves of scripted NPCs straight to a position in the plane."""

from __future__ import annotations

import math

from pytest_garl.simulation.npc_policy import DECISION_STEP_S, STAY, Move, Situation

ARRIVED_M = 0.5


def arrived(goal: tuple[float, float], situation: Situation) -> bool:
    """Whether a position is within half a metre, the stride of one decision, or the narrowest turn.

    A bird would circle around a place within its narrowest turn.
    """
    me = situation.self
    reach = max(ARRIVED_M, DECISION_STEP_S * me.speed_mps, me.type.turn_radius_m)
    return math.dist(situation.self.position_m[:2], goal) < reach


def towards(goal: tuple[float, float], situation: Situation) -> Move:
    """Return the move straight to a position at full speed; stay for an NPC that is there."""
    x, y, _ = situation.self.position_m
    length = math.dist((x, y), goal)
    return Move(x=(goal[0] - x) / length, y=(goal[1] - y) / length) if length > 0 else STAY
