"""How often landings fail in use: an estimate with its interval, from flights of known density.

A sample consists of parts: plain draws from the model of use, which stand for all of it, and draws
within strata, which stand for their share of it.  Within a part every flight fails with the same
probability, independently: the number of failures is binomial, whatever chose the strata.  So the
probability is a sum of shares times binomial probabilities, and no flight has an unknown weight.

The plain draws and the strata are two estimates of the same probability.  They are averaged by
their numbers of flights, which nothing that failed decides.

The interval combines the exact (Clopper-Pearson) intervals of the parts by the distances of their
ends from the estimates, as standard deviations are combined (Zou and Donner 2008, "MOVER").  With
few failures that lower end is too high, so that it is the lower end of Fay and Feuer (1997) for
weighted sums of rare events if this is lower.  The tests compute the coverage exactly: at least
95 % in all cases.  One part has the Clopper-Pearson interval itself.

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
FEW_FAILURES = 10


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
    below, above = [], []
    for weight, part in weighted:
        own = part.failing / part.flights
        low, high = share_interval(part.failing, part.flights, LEVEL)
        below.append(weight * (own - low))
        above.append(weight * (high - own))
    low = share - math.hypot(*below)
    if 0 < sum(part.failing for _, part in weighted) <= FEW_FAILURES:
        low = min(low, _rare_low(weighted, share))
    return FailureProbability(
        share=share, low=max(0.0, low), high=min(1.0, share + math.hypot(*above))
    )


def _weighted(parts: Sequence[SamplePart]) -> list[tuple[float, SamplePart]]:
    """Return the parts that count, each with the weight of its share of failures."""
    plain = [each for each in parts if each.share == 1 and each.flights]
    strata = [each for each in parts if each.share < 1]
    if not all(each.flights for each in strata):
        strata = []
    drawn = sum(each.flights for each in strata)
    total = drawn + sum(each.flights for each in plain)
    found = [(each.flights / total, each) for each in plain]
    return found + [(drawn / total * each.share, each) for each in strata]


def _rare_low(weighted: Sequence[tuple[float, SamplePart]], share: float) -> float:
    """Return the lower end for a weighted sum of few failures (Fay and Feuer 1997, equation 4)."""
    # The quantile of the gamma distribution; scipy.stats takes a second to import.
    from scipy.special import gammaincinv

    variance = math.fsum(part.failing * (weight / part.flights) ** 2 for weight, part in weighted)
    return float(variance / share * gammaincinv(share**2 / variance, (1 - LEVEL) / 2))
