"""Confidence intervals of shares, and tests whether two samples differ."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

MOST_PARTITIONS = 100_000
"""The Mann-Whitney test is exact up to this number of partitions: nine against nine values."""


def share_interval(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Return the exact (Clopper-Pearson) interval of ``count / total``, as fractions."""
    if total == 0:
        return 0.0, 1.0
    # The quantile of the beta distribution; scipy.stats takes a second to import.
    from scipy.special import betaincinv

    tail = (1 - level) / 2
    low = float(betaincinv(count, total - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, total - count, 1 - tail)) if count < total else 1.0
    return low, high


def vargha_delaney(first: Sequence[float], second: Sequence[float]) -> float:
    """Return A12: the probability that a value of ``first`` is larger than one of ``second``.

    A tie counts half.  0.5 means no difference.  Vargha and Delaney (2000) call 0.56 a small
    effect, 0.64 a medium one and 0.71 a large one.  Below 0.5 the second sample is larger, by the
    same scale.
    """
    a, b = np.asarray(first)[:, None], np.asarray(second)[None, :]
    return float((a > b).mean() + (a == b).mean() / 2)


def mann_whitney(first: Sequence[float], second: Sequence[float]) -> tuple[float, float]:
    """Return U of the first sample and the two-sided p-value that both have one distribution.

    Both samples need at least two values.  The test tries every partition of all values and is
    exact, with ties too.  Above :data:`MOST_PARTITIONS` it is the normal approximation.
    """
    from scipy.stats import PermutationMethod, mannwhitneyu

    partitions = math.comb(len(first) + len(second), len(first))
    exact = PermutationMethod(n_resamples=MOST_PARTITIONS)
    method = exact if partitions <= MOST_PARTITIONS else "asymptotic"
    found = mannwhitneyu(first, second, alternative="two-sided", method=method)
    return float(found.statistic), float(found.pvalue)
