"""NSGA-II with pymoo, by ask and tell, and with the crossover of the paper's Algorithm 1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.core.duplicate import NoDuplicateElimination
from pymoo.core.infill import InfillCriterion
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding

from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.operators import Matrix, nuclear_gene_crossover
from pytest_garl.search.seeding import seed_sequence

Objectives = Callable[[Matrix, Sequence[FlownScenario]], Matrix]
"""Takes normalised chromosomes (k, d) and their flights; returns objectives (k, m) to maximise."""
Mutation = Callable[[Matrix, Matrix, Matrix, np.random.Generator], Matrix]
"""Takes offspring (n, d), lower and upper bounds (d,), a generator; returns mutated offspring."""
_MAX_MUTATIONS = 100


class Nsga2:
    """A genetic search, defined by its objectives and its mutation.

    A chromosome ends with the NPCs.  A child inherits the scenario's seed with this end, because
    the NPCs' random moves, which follow from the seed, are part of the parent's success.
    """

    learns = True
    overlaps = False

    def __init__(
        self,
        name: str,
        plan: SearchPlan,
        objectives: Objectives,
        objective_count: int,
        mutation: Mutation,
    ) -> None:
        self._plan, self._objectives, self._mutation = plan, objectives, mutation
        variation, survival = seed_sequence(name, plan.map.name, plan.seed).spawn(2)
        self._rng = np.random.default_rng(variation)
        self._seeds: dict[bytes, int] = {}
        self._flown: dict[bytes, FlownScenario] = {}
        self._generation: Any = None
        genome = plan.genome
        first = np.array(
            [
                self._valid_and_new(genome.random(self._rng), int(self._rng.integers(2**32)))
                for _ in range(plan.population)
            ]
        )
        self._algorithm = GeneticAlgorithm(
            pop_size=plan.population,
            sampling=first,
            mating=_Mating(self),
            survival=_Survival(self),
            eliminate_duplicates=NoDuplicateElimination(),
            advance_after_initial_infill=True,
        )
        problem = Problem(
            n_var=genome.size, n_obj=objective_count, xl=genome.lower, xu=genome.upper
        )
        self._algorithm.setup(problem, seed=int(survival.generate_state(1)[0]), verbose=False)

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        self._generation = self._algorithm.ask()
        return [
            decode(
                row,
                self._plan.genome,
                map=self._plan.map.name,
                seed=self._seeds[row.tobytes()],
            )
            for row in self._generation.get("X")
        ]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Learn from the generation: the best of parents and offspring survive."""
        rows = self._generation.get("X")
        for row, item in zip(rows, flown, strict=True):
            self._flown[row.tobytes()] = item
        values = self.values(rows)
        self._generation.set("F", -values)
        self._algorithm.tell(infills=self._generation)
        return [tuple(float(value) for value in row) for row in values]

    def values(self, rows: Matrix) -> Matrix:
        """Return the objectives of flown chromosomes, with diversity measured within these rows."""
        flown = [self._flown[row.tobytes()] for row in rows]
        return self._objectives(self._plan.genome.normalise(rows), flown)

    def offspring(self, parents: Matrix) -> Matrix:
        """Return as many valid, new chromosomes as there are parents."""
        seeds = np.array([[self._seeds[row.tobytes()]] for row in parents], dtype=np.float64)
        with_seeds = np.concatenate([parents, seeds], axis=1)
        crossed = nuclear_gene_crossover(with_seeds, self._plan.genome.borders, self._rng)
        children = self._mutate(crossed[:, :-1])
        return np.array(
            [
                self._valid_and_new(row, int(seed))
                for row, seed in zip(children, crossed[:, -1], strict=True)
            ]
        )

    def _mutate(self, rows: Matrix) -> Matrix:
        genome = self._plan.genome
        return self._mutation(rows, genome.lower, genome.upper, self._rng)

    def _valid_and_new(self, row: Matrix, seed: int) -> Matrix:
        """Repair a chromosome, and mutate it until it differs from all earlier ones."""
        genome, map = self._plan.genome, self._plan.map
        for _ in range(_MAX_MUTATIONS):
            repaired = encode(repair(decode(row, genome, map=map.name, seed=0), map), genome)
            key = repaired.tobytes()
            if key not in self._seeds:
                self._seeds[key] = seed
                return repaired
            row = self._mutate(row[None])[0]
        return self._valid_and_new(genome.random(self._rng), seed)


class _Mating(InfillCriterion):  # type: ignore[misc]
    """Has pymoo take the offspring of Nsga2."""

    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def do(self, problem: Any, pop: Any, n_offsprings: int, **_: Any) -> Any:
        return Population.new("X", self._search.offspring(pop.get("X")))


class _Survival(RankAndCrowding):  # type: ignore[misc]
    """Rank and crowding by objectives measured again among parents and offspring together."""

    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def _do(self, problem: Any, pop: Any, *args: Any, **kwargs: Any) -> Any:
        pop.set("F", -self._search.values(pop.get("X")))
        return super()._do(problem, pop, *args, **kwargs)
