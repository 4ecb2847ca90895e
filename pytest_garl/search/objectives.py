"""The objectives of searches: the paper's diversity, and the proximity to a violation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.search.operators import Matrix
from pytest_garl.verdicts.judge import CLOSE_CALL_M
from pytest_garl.verdicts.verdict import Margin, MarginName


def diversity(generation: Matrix) -> Matrix:
    """Return each chromosome's mean Euclidean distance to the generation (paper, eq. 1).

    ``generation`` is (k, d), properties normalised to [0, 1]; the sum runs over all k
    members, the chromosome itself (at distance 0) among them, and is divided by k.
    """
    differences = generation[:, None, :] - generation[None, :, :]
    distances: Matrix = np.sqrt((differences**2).sum(axis=2))
    means: Matrix = distances.mean(axis=1)
    return means


def time_to_landing_s(result: FlightResult) -> float:
    """Return the time of the touchdown, or of the end of a flight that did not land."""
    return result.elapsed_s if result.landed_s is None else result.landed_s


SAFE_MARGINS: Mapping[MarginName, float] = MappingProxyType(
    {
        # Landing within a quarter of a metre of the marker's centre, with the default limit.
        "distance": 0.5,
        # Landing in half of the two minutes.
        "time": 60.0,
        "collision": CLOSE_CALL_M,
        "moving": CLOSE_CALL_M,
        "static": CLOSE_CALL_M,
        # Touching down at half of the speed and of the angle that are too hard.
        "touchdown_speed": 1.0,
        "touchdown_tilt": math.radians(10),
        # The system reports the marker again a second after it lost it.
        "dropout": 2.0,
        # The marker's side: nearer to the marker than to a decoy by this much.
        "decoy": 1.5,
        # Within a quarter of a metre of the place that the system meant to land on.
        "tracking": 0.5,
        # Moving by a tenth of a metre after the touchdown.
        "slide": 0.4,
    }
)
"""The margin of each property, in its unit, from which on a flight is safe and no near miss.

Margins of different units are compared as shares of it.  Margins that are not named here have no
degrees, such as that of a crash.
"""
BODIES = frozenset({"collision", "moving", "static"})
"""Margins that are distances to bodies."""
NEAREST_MISS = 0.99
"""Proximity of a flight whose estimate of a property fails, although it violates nothing."""


def violation_proximity(result: FlightResult) -> float:
    """Return how near a flight came to a violation: 1 for a violation, 0 for a wide margin."""
    if result.verdict.violation:
        return 1.0
    return near_miss(result)[1]


def near_miss(result: FlightResult) -> tuple[str, float]:
    """Return the property that a flight without violation came nearest to violating, and how near.

    The nearness is 0 to :data:`NEAREST_MISS`; at 0 the name is empty.  If a flight without landing
    is excused, or its limits allow giving up, distance and time say nothing about the landing
    system, and only the bodies that it came near to count.  If nobody could have seen the marker,
    nothing counts: the flight ended for want of a marker, and no small change mends that.
    """
    verdict = result.verdict
    if verdict.no_landing == "excused":
        return "", 0.0
    name, nearest = "", 0.0
    for margin in verdict.margins:
        if verdict.no_landing and margin.property not in BODIES:
            continue
        nearness = nearness_of(margin)
        if nearness > nearest:
            name, nearest = margin.property, nearness
    return name, nearest


def nearness_of(margin: Margin) -> float:
    """Return the proximity of a margin to its violation; not above 0 if it has no degrees."""
    safe = SAFE_MARGINS.get(margin.property)
    return 0.0 if safe is None else min(NEAREST_MISS, 1 - margin.value / safe)
