"""Do two methods differ over repeats, and by how much."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

MOST_PARTITIONS = 100_000
"""Up to so many ways to deal the values out again, each is tried: nine against nine values."""


def vargha_delaney(first: Sequence[float], second: Sequence[float]) -> float:
    """Return A12: how often a value of the first is the larger one, ties counting half.

    0.5 means no difference; Vargha and Delaney (2000) call 0.56 a small effect, 0.64 a medium and
    0.71 a large one, and likewise below 0.5.
    """
    a, b = np.asarray(first)[:, None], np.asarray(second)[None, :]
    return float((a > b).mean() + (a == b).mean() / 2)


def mann_whitney(first: Sequence[float], second: Sequence[float]) -> tuple[float, float]:
    """Return U of the first and the two-sided p-value of "both are drawn alike".

    Both need two values or more.  Exact, with ties as well, by dealing the values out in every
    possible way; by the normal approximation where there are more than a hundred thousand.
    """
    from scipy.stats import PermutationMethod, mannwhitneyu

    ways = math.comb(len(first) + len(second), len(first))
    exact = PermutationMethod(n_resamples=MOST_PARTITIONS)
    method = exact if ways <= MOST_PARTITIONS else "asymptotic"
    found = mannwhitneyu(first, second, alternative="two-sided", method=method)
    return float(found.statistic), float(found.pvalue)
