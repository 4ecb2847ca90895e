"""Tests of significance of the gate: is a rate worse, a size worse, a violation type new."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Probabilities = NDArray[np.float64]
CONFIRMED_PAIRS = 3
"""Number of pairs of a new violation type whose neighbours are flown."""
NEGLIGIBLE_P = 1e-9
"""A smaller p-value is returned without the sum over less probable outcomes."""
LARGEST_EXACT = 1000
"""Number of pairs up to which the signed-rank test is exact; the work grows with the cube of it.
With more pairs the distribution is normal to about three digits of a p-value of 1 %."""
RATES_TRIED = 120
"""Number of rates, evenly spaced on a logarithmic scale, over which a probability is maximised."""


def mcnemar_p(broke: int, fixed: int) -> float:
    """Return the one-sided p-value of McNemar's exact test that more pairs broke than were fixed.

    If nothing has changed, each discordant pair is as likely to break as to be fixed (McNemar
    1947, Psychometrika 12(2), 153-157).  Of n = ``broke`` + ``fixed`` pairs, the number X of broken
    ones is binomial with probability 1/2, and the p-value is P(X >= broke).  The test is exact
    because a good landing system leaves only a handful of discordant pairs, too few for the
    chi-squared approximation.  It is one-sided because an improvement must never fail the gate.
    Without discordant pairs the p-value is 1.
    """
    n = broke + fixed
    ways: int = 2**n
    return sum(math.comb(n, k) for k in range(broke, n + 1)) / ways


def signed_rank_p(differences: Sequence[float]) -> float:
    """Return the one-sided p-value of Wilcoxon's test that differences tend to be positive.

    The absolute values are ranked; W is the sum of the ranks of the positive differences.  If
    positive and negative are equally probable, each rank is in W with probability 1/2 (Wilcoxon
    1945, Biometrics Bulletin 1(6), 80-83), and the p-value is P(W >= observed).  Zeros are left out
    and ties share their mean rank, as Wilcoxon proposed.  Usual tables are wrong if there are ties,
    so the distribution is computed for the very ranks, by adding one rank after another (Streitberg
    and Roehmel 1986, Statistical Software Newsletter 12(1), 10-17).  Without a difference the
    p-value is 1.
    """
    values = np.array([value for value in differences if value])
    if not len(values):
        return 1.0
    _, places, counts = np.unique(np.abs(values), return_inverse=True, return_counts=True)
    # Twice the mean ranks, which are whole numbers.
    ranks = (2 * np.cumsum(counts) - counts + 1)[places]
    observed = int(ranks[values > 0].sum())
    if len(ranks) > LARGEST_EXACT:
        spread = math.sqrt(float((ranks.astype(float) ** 2).sum())) / 2
        return 0.5 * math.erfc((observed - 1 - ranks.sum() / 2) / spread / math.sqrt(2))
    # W and its complement, the sum of the other ranks, are distributed alike.
    complement = int(ranks.sum()) - observed
    if observed <= complement:
        return 1.0 - _share_of_sums(ranks, observed - 1)
    return _share_of_sums(ranks, complement)


def _share_of_sums(ranks: NDArray[np.int64], most: int) -> float:
    """Return the share of all subsets of ``ranks`` whose sum is at most ``most``."""
    if most < 0:
        return 0.0
    shares = np.zeros(most + 1)
    shares[0] = 1.0
    for rank in ranks:
        with_rank = shares[: max(0, most + 1 - int(rank))] * 0.5
        shares *= 0.5
        shares[int(rank) :] += with_rank
    return float(shares.sum())


def can_reject(differing: int, level: float) -> bool:
    """Return whether a test of signs can reach ``level`` if this number of pairs differ.

    Its smallest p-value is 2^-differing.  A test that cannot reach the level fails nobody by
    chance, so Holm's correction need not count it (Tarone 1990, Biometrics 46(2), 515-522).  The
    number of differing pairs does not depend on which flight of a pair is the head's.
    """
    return 0.5**differing <= level


@functools.lru_cache(maxsize=4096)
def new_type_p(
    *, base: int, changed: int, found: int, neighbours_each: int = 0, failing: int = 0
) -> float:
    """Return the p-value of a violation type that none of ``base`` flights has.

    ``changed`` flights of the head differ from those of the base, and ``found`` of them have the
    type.  ``neighbours_each`` neighbours were flown of each of the first :data:`CONFIRMED_PAIRS` of
    these flights; ``failing`` of all neighbours have the type too.

    An unchanged landing system has the type with some rate v.  The probability that the base shows
    nothing, and that the head shows this result or a less probable one, is

        (1 - v)^base · sum over k of P(found = k) · P(failing >= least(k)),

    where least(k) is the smallest number that, together with k, is no more probable than the
    observation.  The rate is unknown, so the p-value is the maximum over v (as in Barnard's test:
    Barnard 1947, Biometrika 34, 123-138).
    """
    rates = _rates(base)
    observed = _greatest_probability(
        base, changed, found, _neighbours_flown(found, neighbours_each), failing
    )
    if observed < NEGLIGIBLE_P:
        return observed
    total = np.zeros_like(rates)
    for count in range(1, changed + 1):
        flown = _neighbours_flown(count, neighbours_each)
        least = next(
            (
                number
                for number in range(flown + 1)
                if _greatest_probability(base, changed, count, flown, number) <= observed
            ),
            None,
        )
        if least == 0:
            # All larger counts are less probable still.
            total += _tail(changed, rates, count)
            break
        if least is not None:
            exactly = _tail(changed, rates, count) - _tail(changed, rates, count + 1)
            total += exactly * _tail(flown, rates, least)
    return float(((1 - rates) ** base * total).max())


def _neighbours_flown(found: int, neighbours_each: int) -> int:
    """Return the number of neighbours flown for ``found`` flights of a new type."""
    return neighbours_each * min(found, CONFIRMED_PAIRS)


@functools.lru_cache(maxsize=65536)
def _greatest_probability(base: int, changed: int, found: int, flown: int, failing: int) -> float:
    """Return the probability of at least ``found`` and ``failing``, maximised over the rate."""
    rates = _rates(base)
    both = _tail(changed, rates, found) * _tail(flown, rates, failing)
    return float(((1 - rates) ** base * both).max())


def _rates(base: int) -> Probabilities:
    return np.geomspace(0.05 / max(1, base), 0.999, RATES_TRIED)


def _tail(n: int, rates: Probabilities, least: int) -> Probabilities:
    """Return the binomial probability of ``least`` or more of ``n``, for each rate."""
    from scipy.special import bdtrc

    if not 0 < least <= n:
        return np.full_like(rates, float(least <= 0))
    tail: Probabilities = bdtrc(least - 1, n, rates)
    return tail


def holm_adjusted(p_values: Sequence[float]) -> tuple[float, ...]:
    """Return p-values adjusted by Holm's step-down method, in the order given."""
    adjusted, running = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        running = max(running, min(1.0, (len(p_values) - rank) * p_values[index]))
        adjusted[index] = running
    return tuple(adjusted)
