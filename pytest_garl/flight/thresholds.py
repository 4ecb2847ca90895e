"""Figures of the vehicle and of the ground on which the record of a flight is judged."""

from __future__ import annotations

import math

GRAVITY_MPS2 = 9.81
BODY_ABOVE_FEET_M = 0.20
"""Height of the body, whose position a record holds, above the feet."""
COMMIT_M = 2.0
"""Height of the feet below which a landing cannot see the whole marker, and commits itself."""
UPRIGHT_RAD = math.radians(20)
SLID_M = 0.5
"""A UAV that moved farther over the ground than half its span did not stay where it landed."""
HARD_TOUCHDOWN_MPS = 2.0
"""Contact speed of a drop from 0.2 m: the least drop height of EASA CS 27.725."""


def feet_height_m(body_m: float) -> float:
    """Return how high the feet are above the ground, for a body's height; never below it."""
    return max(0.0, body_m - BODY_ABOVE_FEET_M)
