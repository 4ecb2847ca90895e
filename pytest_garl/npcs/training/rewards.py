"""The rewards of an NPC: the paper's equation, and our own."""

from __future__ import annotations

import math

COLLISION = 1.0
"""I of the paper: "a predefined reward value (1 used in our experiments)"."""
RATIO_CAP = 5.0
"""Bound of S_gt / S_d, which grows without limit as the marker is covered."""
APPROACH_WEIGHT = 0.3
APPROACH_RANGE_M = 20.0


def paper(expected_px: int, seen_px: int, *, collided: bool) -> float:
    """Return the paper's reward (section 3.4, equation of R), its ratio bounded.

    ``expected_px`` is S_gt, the marker's area in the frame with nothing in front;
    ``seen_px`` is S_d, the area that the camera sees.  The equation's cases overlap if the two are
    equal.  As its text says, the reward is 0 for an uncovered marker, and also for one that is
    wholly covered or out of the frame.

    A policy exploits the ratio: it jumps from 0 to more than 1 with the first hidden pixel, it is 0
    again if everything is hidden, and a few steps of hiding are worth more than the collision that
    ends the episode.
    """
    reward = COLLISION if collided else 0.0
    if 0 < seen_px < expected_px:
        reward += min(RATIO_CAP, expected_px / seen_px)
    return reward


def potential(distance_m: float) -> float:
    """Return the potential at ``distance_m`` from the UAV's column, at most 0."""
    return -APPROACH_WEIGHT * min(1.0, distance_m / APPROACH_RANGE_M)


def collision_first(
    before_m: float, after_m: float, *, collided: bool, ended: bool, discount: float
) -> float:
    """Return 1 for a collision, plus the gain in potential by the approach to the UAV's column.

    Potential-based shaping (Ng, Harada and Russell 1999), with a potential of 0 at the end of the
    episode, speeds learning up and does not change the best policy.
    """
    after = 0.0 if ended else potential(after_m)
    return (COLLISION if collided else 0.0) + discount * after - potential(before_m)


def column_distance_m(
    thing_m: tuple[float, float, float], uav_m: tuple[float, float, float]
) -> float:
    """Return the horizontal distance of an NPC from the UAV."""
    return math.dist(thing_m[:2], uav_m[:2])
