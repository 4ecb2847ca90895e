"""The tests of the gate: whether a rate is worse and a type of violation new, many at once."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Shares = NDArray[np.float64]
CONFIRMED = 3
"""Pairs of a new type whose neighbours are flown."""
NEGLIGIBLE = 1e-9
"""What is less probable than this stays so, whatever else is added to it."""
SHARES_TRIED = 120
"""So many shares, each the same factor above the last, are tried for the most probable one."""


def worse(broke: int, fixed: int) -> float:
    """Return the one-sided p-value of McNemar's exact test that more broke than was fixed.

    Had nothing changed, each discordant pair would be as likely to have broken as to have been
    fixed (McNemar 1947, Psychometrika 12(2), 153-157), so that of n = ``broke`` + ``fixed`` the
    broken ones are binomial with probability 1/2.  The p-value is P(X >= broke).  It is that
    distribution itself and not McNemar's chi-squared approximation of it, because a good stack
    leaves a handful of discordant pairs; and it is one-sided because a gate asks whether the stack
    got worse: one that got better must never fail it.  Without discordant pairs it is 1.
    """
    n = broke + fixed
    ways: int = 2**n
    return sum(math.comb(n, k) for k in range(broke, n + 1)) / ways


@functools.lru_cache(maxsize=4096)
def looks_new(*, base: int, drawn: int, found: int, beside: int = 0, alike: int = 0) -> float:
    """Return the p-value of a type of violation that none of ``base`` flights has.

    ``drawn`` flights of the head are other ones than the base's, and ``found`` of them have the
    type.  ``beside`` neighbours were flown of each of the first :data:`CONFIRMED` of these, and
    ``alike`` of all neighbours have the type too.

    A stack that did not change has the type in some share v of its flights.  It shows nothing in
    the base and this, or what is less probable still, with the probability

        (1 - v)^base · sum over k of P(found = k) · P(alike >= least(k)),

    where least(k) is the smallest number that with k is no more probable than what was observed.
    The share is unknown, so the one counts for which that is largest (as in Barnard's test: Barnard
    1947, Biometrika 34, 123-138).
    """
    shares = _shares(base)
    observed = _at_most(base, drawn, found, _flown(found, beside), alike)
    if observed < NEGLIGIBLE:
        return observed
    total = np.zeros_like(shares)
    for count in range(1, drawn + 1):
        flown = _flown(count, beside)
        least = next(
            (
                number
                for number in range(flown + 1)
                if _at_most(base, drawn, count, flown, number) <= observed
            ),
            None,
        )
        if least == 0:
            # More of them are less probable still.
            total += _tail(drawn, shares, count)
            break
        if least is not None:
            exactly = _tail(drawn, shares, count) - _tail(drawn, shares, count + 1)
            total += exactly * _tail(flown, shares, least)
    return float(((1 - shares) ** base * total).max())


def _flown(found: int, beside: int) -> int:
    """Return how many neighbours are flown of so many flights."""
    return beside * min(found, CONFIRMED)


@functools.lru_cache(maxsize=65536)
def _at_most(base: int, drawn: int, found: int, flown: int, alike: int) -> float:
    """Return how probable so much or more of both is at the share where it is most probable."""
    shares = _shares(base)
    both = _tail(drawn, shares, found) * _tail(flown, shares, alike)
    return float(((1 - shares) ** base * both).max())


def _shares(base: int) -> Shares:
    return np.geomspace(0.05 / max(1, base), 0.999, SHARES_TRIED)


def _tail(n: int, shares: Shares, least: int) -> Shares:
    """Return the probability of ``least`` or more of ``n`` at each share."""
    from scipy.special import bdtrc

    if not 0 < least <= n:
        return np.full_like(shares, float(least <= 0))
    tail: Shares = bdtrc(least - 1, n, shares)
    return tail


def holm(values: Sequence[float]) -> tuple[float, ...]:
    """Return p-values adjusted by Holm's step-down method, in the order given."""
    adjusted, running = [0.0] * len(values), 0.0
    for rank, index in enumerate(sorted(range(len(values)), key=values.__getitem__)):
        running = max(running, min(1.0, (len(values) - rank) * values[index]))
        adjusted[index] = running
    return tuple(adjusted)
