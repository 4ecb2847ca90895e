"""Intervals of what judges measure: paired, and drawn over what is independent."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

Values = NDArray[np.float64]
RESAMPLES = 10_000
LEVEL = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A figure with its interval."""

    value: float
    low: float
    high: float

    def text(self, digits: int = 2, scale: float = 1.0) -> str:
        """Return such as ``0.71 [0.60, 0.82]``; a mean of one value has no interval."""
        value, low, high = (scale * each for each in (self.value, self.low, self.high))
        if math.isinf(low):
            return f"{value:.{digits}f}"
        return f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def mean_of(values: Sequence[float]) -> Estimate:
    """Return the mean, with Student's t-interval over values that are independent."""
    mean, count = float(np.mean(values)), len(values)
    if count < 2:
        return Estimate(value=mean, low=float("-inf"), high=float("inf"))
    half = float(t.ppf((1 + LEVEL) / 2, count - 1) * np.std(values, ddof=1) / count**0.5)
    return Estimate(value=mean, low=mean - half, high=mean + half)


def over_clusters(
    own: Values, rival: Values, families: Sequence[str], *, difference: bool = False
) -> Estimate:
    """Return the ratio of the means of two tables (faults, seeds), or rival less own.

    A bootstrap draws the seeds, and the families of the faults.  A pair that nobody counts is nan
    in both tables.
    """
    names = sorted(set(families))
    member = np.array([[each == name for name in names] for each in families], dtype=float)
    counted = ~(np.isnan(own) | np.isnan(rival))
    tables = [np.where(counted, each, 0.0) for each in (own, rival, np.ones_like(own))]
    rng = np.random.default_rng(0)
    seeds, groups = own.shape[1], len(names)
    weights = rng.multinomial(seeds, [1 / seeds] * seeds, size=RESAMPLES).astype(float)
    drawn = rng.multinomial(groups, [1 / groups] * groups, size=RESAMPLES) @ member.T
    ours, theirs, pairs = (
        np.einsum("bf,fs,bs->b", drawn, each * counted, weights) for each in tables
    )
    whole = [float((each * counted).sum()) for each in tables]
    if difference:
        values, value = (theirs - ours) / np.maximum(1, pairs), (whole[1] - whole[0]) / whole[2]
    else:
        values, value = ours / np.maximum(1e-9, theirs), whole[0] / whole[1]
    low, high = np.quantile(values[pairs > 0], [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(value=value, low=float(low), high=float(high))


def over_pairs(
    own: Sequence[float] | Values | NDArray[np.bool_],
    rival: Sequence[float] | Values | NDArray[np.bool_],
    *,
    difference: bool,
    resamples: int = RESAMPLES,
) -> Estimate:
    """Return the ratio of means of paired values, or own less rival; a bootstrap draws pairs."""
    # Equal pairs are drawn together, which is the same bootstrap.
    pairs, often = np.unique(np.array([own, rival], dtype=float), axis=1, return_counts=True)
    rng, count = np.random.default_rng(0), int(often.sum())
    weights = rng.multinomial(count, often / count, size=resamples)
    drawn, whole = weights @ pairs.T, pairs @ often
    if difference:
        values, value = (drawn[:, 0] - drawn[:, 1]) / count, float(whole[0] - whole[1]) / count
    else:
        # A rival without a find counts as one with half a find.
        values, value = drawn[:, 0] / np.maximum(0.5, drawn[:, 1]), whole[0] / max(0.5, whole[1])
    low, high = np.quantile(values, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Estimate(value=float(value), low=float(low), high=float(high))


def p_of_signs(differences: Sequence[float]) -> float:
    """Return the two-sided p of paired differences: as likely as flipped signs are as extreme."""
    values = np.array(differences, dtype=float)
    if len(values) > 16:
        signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(2**16, len(values)))
    else:
        signs = np.array(list(itertools.product([-1.0, 1.0], repeat=len(values))))
    means = np.abs(signs @ values)
    return float(np.mean(means >= abs(values.sum()) - 1e-9))
