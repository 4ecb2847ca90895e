"""use: scenarios as often as they occur in use, and in known shares more often where it fails.

It estimates how often landings fail, and seeks nothing.  All scenarios are drawn from a model of
use (``scenarios/use_model.py``):

1. The first flights are plain draws: a sample of use.
2. From flights so far the method predicts a region in which the landing system fails
   (``search/failure_rules.py``): from those of an archive, if it knows at least so many, else from
   the first 100 plain draws.  It counts how many of 100,000 draws lie in the region; these are not
   flown.
3. All later scenarios are draws in the region and draws outside of it, in shares that are fixed
   before the first of them.  In the region more are flown than occur, up to half of the flights.

So the later flights are a sample from a mixture of known density: two strata of the model of use.
Each scenario of the region weighs the region's share in use over its share in the flights, and an
estimate is right whatever the region is; a good one makes it more precise.  No weight exceeds two
(defensive mixture, Owen and Zhou 2000).  What failed decides neither when the sample of step 1 ends
nor what it weighs, so that neither part is biased.

A generation is asked for while the one before it is flown, so that no worker waits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.execution.result import Origin
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import use_of
from pytest_garl.scenarios.use_model import Matrix
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.failure_rules import (
    LEAST_FAILING,
    Mask,
    Region,
    learn_region,
    table_of_rows,
    table_of_scenarios,
)
from pytest_garl.search.method import FlownScenario, MethodDeclaration, SearchPlan
from pytest_garl.search.objectives import violation_proximity
from pytest_garl.search.seeding import seed_sequence

LEARNED_FROM = 100
"""Plain draws from which a region is learned if no archive knows of earlier flights."""
MEASURED = 100_000
"""Draws that measure the share of a region: a share of 10 % to 0.1 % (one standard deviation)."""
BATCH = 10_000
LEAST_SHARE = 1e-3
"""A region with a smaller share of use is not flown: too few draws say how large it is."""
LARGEST_INSIDE = 0.5
"""Largest share of the flights that lie in the region."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Strata:
    """The region, its share in use, and the share of the flights that are drawn in it."""

    region: Region
    share: float
    flown_share: float


class Use:
    """The sample: its plain draws, and its draws in two strata."""

    learns = True
    overlaps = True

    def __init__(self, plan: SearchPlan) -> None:
        if plan.use is None:
            raise GarlError(
                "the search method use needs a model of use: name its file in the ini key "
                "garl_use; `garl domain use` prints one to edit"
            )
        self._plan, self._model = plan, use_of(plan.use, plan.genome, plan.map)
        seeds = seed_sequence("use", plan.map.name, plan.seed)
        # Plain draws have numbers of their own, so that all landing systems get the same ones.
        self._rng, self._strata_rng = (
            np.random.default_rng(each) for each in (seeds, seeds.spawn(1)[0])
        )
        self._learning = math.ceil(LEARNED_FROM / plan.population)
        """How many generations the region is learned from."""
        self._generation = -1
        self._told: list[Sequence[FlownScenario]] = []
        self._strata: Strata | None = None
        self._drawn = 0
        """How many scenarios were drawn in the strata."""
        self.origins: Sequence[Origin] = ()

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        self._generation += 1
        # The generation after the last one that teaches is asked for before its results are known.
        first = 1 if self._knows_enough else self._learning + 1
        if self._generation == first:
            self._strata = self._predicted()
        strata, count = self._strata, self._plan.population
        if strata is None:
            self.origins = [Origin(how="use", share=1.0)] * count
            return [self._scenario(row, self._rng) for row in self._model.rows(count, self._rng)]
        places = range(self._drawn, self._drawn + count)
        self._drawn += count
        inside = [_is_inside(place, strata.flown_share) for place in places]
        rows = self._stratified(strata.region, inside)
        words = strata.region.words
        self.origins = [
            Origin(how="inside", share=strata.share, region=words)
            if each
            else Origin(how="outside", share=1 - strata.share, region=words)
            for each in inside
        ]
        return [self._scenario(row, self._strata_rng) for row in rows]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Keep the flights from which the region is learned; return proximities to a violation."""
        if len(self._told) < self._learning:
            self._told.append(flown)
        return [(violation_proximity(item.result),) for item in flown]

    @property
    def _knows_enough(self) -> bool:
        known = self._plan.known
        failing = sum(item.result.verdict.violation for item in known)
        return len(known) >= LEARNED_FROM and failing >= LEAST_FAILING

    def _predicted(self) -> Strata | None:
        """Return the strata that the flights so far suggest; None if they say too little."""
        flown = list(self._plan.known) if self._knows_enough else []
        flown = flown or [item for generation in self._told for item in generation]
        table = table_of_scenarios([item.scenario for item in flown], self._plan.map)
        fails = np.array([item.result.verdict.violation for item in flown])
        region = learn_region(table, fails)
        if region is None:
            return None
        drawn = [self._covered(region, BATCH)[1] for _ in range(MEASURED // BATCH)]
        share = float(np.mean(drawn))
        if not LEAST_SHARE <= share <= 1 - LEAST_SHARE:
            return None
        flown_share = flown_share_of(share, fails, region.covers(table.values))
        return Strata(region=region, share=share, flown_share=flown_share)

    def _covered(self, region: Region, count: int) -> tuple[Matrix, Mask]:
        """Draw chromosomes, (count, size), and whether a region covers each."""
        rows = self._model.rows(count, self._strata_rng)
        covered = region.covers(table_of_rows(rows, self._model.genome, self._plan.map).values)
        return rows, covered

    def _stratified(self, region: Region, inside: Sequence[bool]) -> Sequence[Matrix]:
        """Return chromosomes that lie in the region where it says so, and else outside of it."""
        found: dict[bool, list[Matrix]] = {True: [], False: []}
        while any(inside.count(side) > len(found[side]) for side in found):
            rows, covered = self._covered(region, BATCH)
            for side in found:
                found[side] += list(rows[covered == side][: len(inside)])
        taken = {side: iter(rows) for side, rows in found.items()}
        return [next(taken[side]) for side in inside]

    def _scenario(self, row: Matrix, rng: np.random.Generator) -> Scenario:
        plan, seed = self._plan, int(rng.integers(2**32))
        return repair(decode(row, self._model.genome, map=plan.map.name, seed=seed), plan.map)


def flown_share_of(share: float, fails: Mask, covered: Mask) -> float:
    """Return the share of the flights in a region that has a ``share`` of use.

    It is the one with the smallest variance for the flights so far (Neyman 1934): proportional to
    share and standard deviation of each stratum.  A region has at least its share, and at most half
    of the flights.
    """
    inside, outside = (
        part * _deviation(int(np.count_nonzero(fails & place)), int(np.count_nonzero(place)))
        for part, place in ((share, covered), (1 - share, ~covered))
    )
    return max(share, min(inside / (inside + outside), LARGEST_INSIDE))


def _is_inside(place: int, share: float) -> bool:
    """Whether a place is the region's: of the first n places that share is, always."""
    return math.floor((place + 1) * share) > math.floor(place * share)


def _deviation(failing: int, count: int) -> float:
    """Return the standard deviation of one flight; one of each outcome is added."""
    fails = (failing + 1) / (count + 2)
    return math.sqrt(fails * (1 - fails))


METHOD = MethodDeclaration(make=Use, policy="waypoint", remembers=True)
