"""Count kinds of violation at equal effort: Hill numbers and rarefaction.

A kind is the signature of a violation.  More flights show more kinds, and so do more
violations, so that bare counts of unequal searches say little.  Every figure here is of
the flights that were flown.  None estimates the kinds that nobody has seen: such estimates want a
random sample, and a search that learns draws none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.95
"""Share of the draws that a range of kinds covers."""


def hill_number(counts: Sequence[int], order: float) -> float:
    """Return the effective number of kinds (Hill 1973, Ecology 54(2), 427-432).

    ``counts`` are the violations of each kind.  This many equally frequent kinds would be as
    diverse.  Order 0 counts all kinds alike, order 1 is the exponential of Shannon's entropy, order
    2 the inverse of Simpson's index and hardly counts rare kinds.  It is the plug-in value, without
    a correction for unseen kinds, and 0 without violations.
    """
    found = np.array([count for count in counts if count], dtype=float)
    if not found.size:
        return 0.0
    shares = found / found.sum()
    if order == 1:
        return math.exp(-float(shares @ np.log(shares)))
    return float((shares**order).sum() ** (1 / (1 - order)))


def kinds_in_violations(counts: Sequence[int], violations: int) -> float:
    """Return how many kinds a number of violations shows on average, if drawn at random.

    Rarefaction by individuals (Hurlbert 1971, Ecology 52(4), 577-586).  Raises ValueError if more
    are to be drawn than there are.
    """
    return kinds_in_flights(counts, sum(counts), violations)


def kinds_in_flights(counts: Sequence[int], flights: int, drawn: int) -> float:
    """Return how many kinds ``drawn`` of the flights show on average, drawn at random.

    Rarefaction by samples: a flight is a sample that shows one kind or none (Colwell et al. 2012,
    J. Plant Ecology 5(1), 3-21).  Raises ValueError if more are to be drawn than there are.
    """
    _check(counts, flights, drawn)
    return math.fsum(1 - _unseen(count, flights, drawn) for count in counts)


def kinds_in_a_draw(counts: Sequence[int], flights: int, drawn: int) -> NDArray[np.float64]:
    """Return the probability that ``drawn`` of the flights, drawn at random, show 0, 1, 2, … kinds.

    Shape (kinds + 1,).  Each flight shows one kind or none.  Each kind takes a binomial number of
    its flights, and so do the flights without a violation; given that these are ``drawn`` in all,
    every draw is equally probable.  Raises ValueError if more are to be drawn than there are.
    """
    from scipy.stats import binom

    _check(counts, flights, drawn)
    share, taken = drawn / flights if flights else 0.0, np.arange(drawn + 1)
    # [flights taken so far, kinds shown]
    chances = np.zeros((drawn + 1, len(counts) + 1))
    chances[0, 0] = 1.0
    for place, count in enumerate(counts):
        own = binom.pmf(taken, count, share)
        without, shown = chances * own[0], np.array([0.0, *own[1:]])
        for kinds in range(place + 1):
            without[:, kinds + 1] += np.convolve(chances[:, kinds], shown)[: drawn + 1]
        chances = without
    weights = binom.pmf(drawn - taken, flights - sum(counts), share) @ chances
    found: NDArray[np.float64] = weights / weights.sum()
    return found


def range_of_kinds(
    counts: Sequence[int], flights: int, drawn: int, level: float = LEVEL
) -> tuple[int, int]:
    """Return between which numbers of kinds a share ``level`` of the draws lies.

    It says how much depends on which flights are drawn, so it holds for flights that learn from
    each other too.  It says nothing of other seeds: the interval of Colwell et al. (2012) would,
    if the flights were independent, and those of a search that learns are not.
    """
    chances = np.cumsum(kinds_in_a_draw(counts, flights, drawn))
    tail = (1 - level) / 2
    low, high = (int(np.argmax(chances > share - _ROUNDING)) for share in (tail, 1 - tail))
    return low, high


_ROUNDING = 1e-9


def _check(counts: Sequence[int], flights: int, drawn: int) -> None:
    if not 0 <= drawn <= flights or sum(counts) > flights:
        raise ValueError(f"found {drawn} of {flights} flights with {sum(counts)} violations")


def _unseen(count: int, flights: int, drawn: int) -> float:
    """Return the probability that a draw shows none of ``count`` flights."""
    steps = np.arange(count)
    factors = np.maximum(flights - drawn - steps, 0) / (flights - steps)
    return float(factors.prod())
