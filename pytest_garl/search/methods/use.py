"""use: scenarios as often as they occur in use, and in known shares more often where it may fail.

It estimates how often landings fail, and seeks nothing.  All scenarios are drawn from a model of
use (``scenarios/use_model.py``):

1. The first flights are plain draws: a sample of use.
2. The model of the landing system (``search/model.py``) is fitted to flights: to those of an
   archive, if it knows at least so many, else to the first 100 plain draws.  The quarter of use
   that is most likely to fail by this model is the predicted region.  It is found from 20,000
   draws, which are not flown.
3. Half of all later scenarios are draws in the region, half are draws outside of it.

So the later flights are a sample from a mixture of known density: two strata of the model of use.
An estimate from it is right whatever the region is, and more precise if more of the failures lie in
it: a flight in the region weighs 1/4 over 1/2, any other one 3/4 over 1/2.  No weight exceeds two,
so that a wrong region costs little (defensive mixture, Owen and Zhou 2000).  What fails decides
neither when the plain draws end nor what they weigh, so that neither part is biased.

On the stand-in of a landing, whose truth is known, ``python -m lab.failure_probability`` measures
what the region is worth (docs/results/failure-probability.md).  A region of rules in words, as
``garl risk`` prints them, holds too few of the failures to be worth anything here.

A generation is asked for while the one before it is flown, so that no worker waits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pytest_garl.errors import GarlError
from pytest_garl.execution.result import Origin
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import use_of
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.columns import Columns, Mask
from pytest_garl.search.method import FlownScenario, MethodDeclaration, SearchPlan
from pytest_garl.search.model import MarginModel, proximities, share_above
from pytest_garl.search.objectives import violation_proximity
from pytest_garl.search.operators import Matrix
from pytest_garl.search.seeding import seed_sequence

LEARNED_FROM = 100
"""Plain draws from which a region is learned if no archive knows of as many earlier flights."""
REGION_SHARE = 0.25
"""Share of use that the region has at most: less of it if landings are equally likely to fail."""
MEASURED = 20_000
"""Draws that find the region: its share of use is exact to 0.3 % (one standard deviation)."""
BATCH = 500


class PredictedRegion:
    """The landings that are most likely to fail, by a model of the landing system.

    The model is fitted to flights: their chromosomes (n, d), how near they came to violating each
    property (n, p), and 1 for each that did (n,).  ``draws`` (m, d) are chromosomes drawn from a
    model of use; ``share`` is the share of them in the region.
    """

    def __init__(
        self, genome: Genome, rows: Matrix, proximity: Matrix, violates: Matrix, draws: Matrix
    ) -> None:
        # How rare a kind is does not matter here.
        rarity = np.zeros(len(rows))
        self._model = MarginModel(Columns(genome), rows, proximity, violates, rarity)
        likely = self._likely(draws)
        self._threshold = float(np.sort(likely)[math.ceil((1 - REGION_SHARE) * len(likely)) - 1])
        self.share = float(np.mean(likely > self._threshold))

    def covers(self, rows: Matrix) -> Mask:
        """Return which chromosomes (m, d) lie in the region, shape (m,)."""
        found: Mask = self._likely(rows) > self._threshold
        return found

    def _likely(self, rows: Matrix) -> Matrix:
        """Return how likely chromosomes are to violate any property."""
        found = np.empty(len(rows))
        for begin in range(0, len(rows), BATCH):
            expected = self._model.predict(rows[begin : begin + BATCH])
            near = share_above(expected.proximity, 1.0, expected.spread)
            found[begin : begin + BATCH] = 1 - np.prod(1 - near, axis=1)
        return found


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
        self._region: PredictedRegion | None = None
        self.origins: Sequence[Origin] = ()

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        self._generation += 1
        from_archive = len(self._plan.known) >= LEARNED_FROM
        # The generation after the last one that teaches is asked for before its results are known.
        if self._generation == (1 if from_archive else self._learning + 1):
            self._region = self._predicted(
                self._plan.known
                if from_archive
                else [item for generation in self._told for item in generation]
            )
        region, count = self._region, self._plan.population
        if region is None:
            self.origins = [Origin(how="use", share=1.0)] * count
            return [self._scenario(row, self._rng) for row in self._model.rows(count, self._rng)]
        # The last generation may be flown in part: one place after the other takes turns.
        inside = [place % 2 == self._generation % 2 for place in range(count)]
        self.origins = [
            Origin(how="inside", share=region.share)
            if each
            else Origin(how="outside", share=1 - region.share)
            for each in inside
        ]
        return [self._scenario(row, self._strata_rng) for row in self._stratified(region, inside)]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Keep the flights from which the region is learned; return proximities to a violation."""
        if len(self._told) < self._learning:
            self._told.append(flown)
        return [(violation_proximity(item.result),) for item in flown]

    def _predicted(self, flown: Sequence[FlownScenario]) -> PredictedRegion | None:
        """Return the region that flights suggest; None if all landings are equally likely."""
        genome = self._plan.genome
        region = PredictedRegion(
            genome,
            np.array([encode(item.scenario, genome) for item in flown]),
            np.array([proximities(item.result) for item in flown]),
            np.array([float(item.result.verdict.violation) for item in flown]),
            self._model.rows(MEASURED, self._strata_rng),
        )
        return region if region.share > 0 else None

    def _stratified(self, region: PredictedRegion, inside: Sequence[bool]) -> Sequence[Matrix]:
        """Return chromosomes that lie in the region where ``inside`` is set, and else outside."""
        found: dict[bool, list[Matrix]] = {True: [], False: []}
        while any(inside.count(side) > len(found[side]) for side in found):
            rows = self._model.rows(BATCH, self._strata_rng)
            covered = region.covers(rows)
            for side in found:
                found[side] += list(rows[covered == side][: len(inside)])
        taken = {side: iter(rows) for side, rows in found.items()}
        return [next(taken[side]) for side in inside]

    def _scenario(self, row: Matrix, rng: np.random.Generator) -> Scenario:
        plan, seed = self._plan, int(rng.integers(2**32))
        return repair(decode(row, self._model.genome, map=plan.map.name, seed=seed), plan.map)


METHOD = MethodDeclaration(make=Use, policy="waypoint", remembers=True)
