"""The objectives of searches: the paper's diversity, and the proximity to a violation."""

from __future__ import annotations

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.search.operators import Matrix
from pytest_garl.verdicts.judge import CLOSE_CALL_M


def diversity(generation: Matrix) -> Matrix:
    """Return each chromosome's mean Euclidean distance to the generation (paper, eq. 1).

    ``generation`` is (k, d), properties normalised to [0, 1]; the sum runs over all k
    members, the chromosome itself (at distance 0) among them, and is divided by k.
    """
    differences = generation[:, None, :] - generation[None, :, :]
    distances: Matrix = np.sqrt((differences**2).sum(axis=2))
    means: Matrix = distances.mean(axis=1)
    return means


def violation_proximity(result: FlightResult) -> float:
    """Return how near a flight came to a violation: 1 for a violation, 0 for a wide margin.

    The margin of each decided property is taken as a share of its limit; the smallest share
    counts.  An aborted flight decides neither distance nor time, so only the distance to the
    nearest body counts.
    """
    verdict = result.verdict
    if verdict.violation:
        return 1.0
    shares = []
    for margin in verdict.margins:
        if margin.property == "collision":
            shares.append(margin.value / CLOSE_CALL_M)
        elif margin.property == "distance" and margin.decided:
            shares.append(margin.value / (margin.value + result.final_distance_m))
        elif margin.property == "time" and margin.decided:
            shares.append(margin.value / (margin.value + result.elapsed_s))
    return 1.0 - min(1.0, max(0.0, min(shares, default=1.0)))
