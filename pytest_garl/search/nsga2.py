"""NSGA-II by pymoo's ask and tell, with the operators of the paper (Algorithm 1)."""

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
"""From normalised chromosomes (k, d) and their flights to objectives (k, m), all maximised."""
Mutation = Callable[[Matrix, Matrix, Matrix, np.random.Generator], Matrix]
"""From offspring (n, d), lower and upper bounds (d,) and a generator to mutated offspring."""
_TRIES = 100


class Nsga2:
    """A genetic search, defined by its objectives and its mutation.

    ``width`` is the number of objectives.  A child inherits the scenario's seed with the tail of
    the chromosome, which holds the NPCs: their random moves are part of the parent's success.
    """

    learns = True

    def __init__(
        self, name: str, plan: SearchPlan, objectives: Objectives, width: int, mutation: Mutation
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
                self._valid(genome.random(self._rng), int(self._rng.integers(2**32)))
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
        problem = Problem(n_var=genome.size, n_obj=width, xl=genome.lower, xu=genome.upper)
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
        """Return the objectives of flown chromosomes, measured among each other."""
        flown = [self._flown[row.tobytes()] for row in rows]
        return self._objectives(self._plan.genome.normalise(rows), flown)

    def offspring(self, parents: Matrix) -> Matrix:
        """Return as many valid, new chromosomes as there are parents."""
        seeds = np.array([[self._seeds[row.tobytes()]] for row in parents], dtype=np.float64)
        whole = np.concatenate([parents, seeds], axis=1)
        crossed = nuclear_gene_crossover(whole, self._plan.genome.borders, self._rng)
        children = self._mutate(crossed[:, :-1])
        return np.array(
            [
                self._valid(row, int(seed))
                for row, seed in zip(children, crossed[:, -1], strict=True)
            ]
        )

    def _mutate(self, rows: Matrix) -> Matrix:
        genome = self._plan.genome
        return self._mutation(rows, genome.lower, genome.upper, self._rng)

    def _valid(self, row: Matrix, seed: int) -> Matrix:
        """Repair a chromosome; mutate a known one until it is new."""
        genome, map = self._plan.genome, self._plan.map
        for _ in range(_TRIES):
            repaired = encode(repair(decode(row, genome, map=map.name, seed=0), map), genome)
            key = repaired.tobytes()
            if key not in self._seeds:
                self._seeds[key] = seed
                return repaired
            row = self._mutate(row[None])[0]
        return self._valid(genome.random(self._rng), seed)


class _Mating(InfillCriterion):  # type: ignore[misc]
    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def do(self, problem: Any, pop: Any, n_offsprings: int, **_: Any) -> Any:
        return Population.new("X", self._search.offspring(pop.get("X")))


class _Survival(RankAndCrowding):  # type: ignore[misc]
    """Rank and crowding by objectives that are measured again in the union of P and O."""

    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def _do(self, problem: Any, pop: Any, *args: Any, **kwargs: Any) -> Any:
        pop.set("F", -self._search.values(pop.get("X")))
        return super()._do(problem, pop, *args, **kwargs)
