"""What an object is rewarded for: the paper's equation, and our own."""

from __future__ import annotations

import math

COLLISION = 1.0
"""I of the paper: "a predefined reward value (1 used in our experiments)"."""
RATIO_CAP = 5.0
"""Bound of S_gt / S_d, which grows without end as the marker is nearly covered."""
APPROACH_WEIGHT = 0.3
APPROACH_RANGE_M = 20.0


def paper(expected_px: int, seen_px: int, *, collided: bool) -> float:
    """Return the paper's reward (section 3.4, equation of R), its ratio bounded.

    ``expected_px`` is S_gt, the marker's area in the frame with nothing in front;
    ``seen_px`` is S_d, what the camera sees of it.  The equation's cases overlap where the
    two are equal; as its text says, an uncovered marker is worth nothing, nor is one that is
    wholly covered or out of the frame.

    The ratio has properties that a policy exploits: it leaps from 0 to more than 1 with the
    first hidden pixel, is 0 again where everything is hidden, and a few steps of hiding
    are worth more than the collision that ends the episode.
    """
    reward = COLLISION if collided else 0.0
    if 0 < seen_px < expected_px:
        reward += min(RATIO_CAP, expected_px / seen_px)
    return reward


def potential(distance_m: float) -> float:
    """Return how good it is to be ``distance_m`` from the UAV's column, at most 0."""
    return -APPROACH_WEIGHT * min(1.0, distance_m / APPROACH_RANGE_M)


def collision_first(
    before_m: float, after_m: float, *, collided: bool, ended: bool, discount: float
) -> float:
    """Return 1 for a collision, and what the approach to the UAV's column is worth.

    Potential-based shaping (Ng, Harada and Russell 1999) with a potential of 0 where the
    episode ended: it speeds learning up and leaves the best policy as it is.
    """
    after = 0.0 if ended else potential(after_m)
    return (COLLISION if collided else 0.0) + discount * after - potential(before_m)


def column_distance_m(
    thing_m: tuple[float, float, float], uav_m: tuple[float, float, float]
) -> float:
    """Horizontal distance of an object from the UAV."""
    return math.dist(thing_m[:2], uav_m[:2])
