"""The tests of the gate: whether a rate is worse and a type of violation new, many at once."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

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
def looks_new(*, base: int, drawn: int, found: int, neighbours: int = 0, alike: int = 0) -> float:
    """Return the p-value of a type of violation that none of ``base`` flights has.

    ``drawn`` flights of the head are other ones than the base's, and ``found`` of them have the
    type; of ``neighbours`` flights of scenarios beside these, ``alike`` have it too.  A stack that
    did not change has the type in some share v of its flights and shows it like this with the
    probability (1 - v)^base · P(Bin(drawn, v) >= found) · P(Bin(neighbours, v) >= alike).  The
    share is unknown, so the one counts for which that is largest (as in Barnard's test: Barnard
    1947, Biometrika 34, 123-138).
    """
    lowest = 0.05 / max(1, base)
    factor = math.pow(lowest, -1 / SHARES_TRIED)
    shares = [lowest * math.pow(factor, step) for step in range(SHARES_TRIED)]
    return max(
        (1 - share) ** base * _tail(drawn, share, found) * _tail(neighbours, share, alike)
        for share in shares
    )


def _tail(n: int, share: float, least: int) -> float:
    """Return the probability of ``least`` or more of ``n`` at a share."""
    below = (math.comb(n, k) * share**k * (1 - share) ** (n - k) for k in range(least))
    return max(0.0, 1.0 - math.fsum(below))


def holm(values: Sequence[float]) -> tuple[float, ...]:
    """Return p-values adjusted by Holm's step-down method, in the order given."""
    adjusted, running = [0.0] * len(values), 0.0
    for rank, index in enumerate(sorted(range(len(values)), key=values.__getitem__)):
        running = max(running, min(1.0, (len(values) - rank) * values[index]))
        adjusted[index] = running
    return tuple(adjusted)
