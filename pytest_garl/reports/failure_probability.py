"""How often landings fail in use: an estimate with its interval, from flights of known density.

A sample consists of parts: plain draws from the model of use, which stand for all of it, and draws
within strata, which stand for their share of it.  Within a part every flight fails with the same
probability, independently: the number of failures is binomial, whatever chose the strata.  So the
probability is a sum of shares times binomial probabilities, and no flight has an unknown weight.

The plain draws and the strata are two estimates of the same probability.  They are averaged by
their numbers of flights, which nothing that failed decides.

The interval of one part is the exact one (Clopper and Pearson).  That of several is, with few
failures, Fay's and Feuer's (1997) for weighted sums of rare events, which is conservative; else it
combines the Jeffreys intervals of the parts by the distances of their ends from the estimates, as
standard deviations are combined (Zou and Donner 2008, "MOVER").  The alternatives failed a
simulation: MOVER alone has too high a lower end with few failures (92 % of its intervals hold the
truth in the worst case), and with Clopper-Pearson intervals of the parts it is wider than that of
as many plain draws.

Bred and stratified flights of a search are in no sample.  The draws of a stratum are the most
extreme of eight, and depend on counts: their density has no closed form.  At most three conditions
act in random flights of a search, and in use more do in many landings, so that no weights make
them a sample of use.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pytest_garl.verdicts.statistics import share_interval

LEVEL = 0.95
FEW_FAILURES = 20
"""Up to which the interval is that of rare events."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplePart:
    """Flights whose scenarios are draws from one part of use.

    ``share`` is the share of landings in use that lie in the part.  Inconclusive flights are left
    out.  ``how`` is what origins call the draws.
    """

    how: str
    share: float
    flights: int
    failing: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureProbability:
    """The share of landings in use that fail, with the ends of its 95 % interval."""

    share: float
    low: float
    high: float


def failure_probability(parts: Sequence[SamplePart]) -> FailureProbability | None:
    """Return the share of landings that fail; None if the parts are no sample of all of use.

    Parts whose ``share`` is 1 are plain draws; all others together are the strata, which count only
    if each of them has flights.
    """
    weighted = _weighted(parts)
    if not weighted:
        return None
    if len(weighted) == 1:
        (_, part), *_ = weighted
        low, high = share_interval(part.failing, part.flights, LEVEL)
        return FailureProbability(share=part.failing / part.flights, low=low, high=high)
    share = math.fsum(weight * part.failing / part.flights for weight, part in weighted)
    few = sum(part.failing for _, part in weighted) <= FEW_FAILURES
    low, high = _of_rare(weighted, share) if few else _combined(weighted, share)
    return FailureProbability(share=share, low=max(0.0, low), high=min(1.0, high))


Weighted = Sequence[tuple[float, SamplePart]]


def _weighted(parts: Sequence[SamplePart]) -> Weighted:
    """Return the parts that count, each with the weight of its share of failures."""
    plain = [each for each in parts if each.share == 1 and each.flights]
    strata = [each for each in parts if each.share < 1]
    if not all(each.flights for each in strata):
        strata = []
    drawn = sum(each.flights for each in strata)
    total = drawn + sum(each.flights for each in plain)
    found = [(each.flights / total, each) for each in plain]
    return found + [(drawn / total * each.share, each) for each in strata]


def _of_rare(weighted: Weighted, share: float) -> tuple[float, float]:
    """Return the ends for a weighted sum of few failures (Fay and Feuer 1997)."""
    # The quantile of the gamma distribution; scipy.stats takes a second to import.
    from scipy.special import gammaincinv

    def quantile(mean: float, variance: float, level: float) -> float:
        return float(variance / mean * gammaincinv(mean**2 / variance, level))

    tail = (1 - LEVEL) / 2
    steps = [weight / part.flights for weight, part in weighted]
    variance = math.fsum(
        part.failing * step**2 for step, (_, part) in zip(steps, weighted, strict=True)
    )
    low = quantile(share, variance, tail) if share else 0.0
    # One failure more, of the largest weight.
    return low, quantile(share + max(steps), variance + max(steps) ** 2, 1 - tail)


def _combined(weighted: Weighted, share: float) -> tuple[float, float]:
    """Return the ends that the Jeffreys intervals of the parts give (Zou and Donner 2008)."""
    # The quantile of the beta distribution.
    from scipy.special import betaincinv

    tail = (1 - LEVEL) / 2
    below, above = [], []
    for weight, part in weighted:
        fails, lands = part.failing, part.flights - part.failing
        low, high = (float(betaincinv(fails + 0.5, lands + 0.5, e)) for e in (tail, 1 - tail))
        own = fails / part.flights
        below.append(weight * (own - low) if fails else 0.0)
        above.append(weight * (high - own) if lands else 0.0)
    return share - math.hypot(*below), share + math.hypot(*above)
