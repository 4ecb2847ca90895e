"""NSGA-II by pymoo's ask and tell, with the operators of the paper (Algorithm 1)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.core.duplicate import NoDuplicateElimination
from pymoo.core.infill import InfillCriterion
from pymoo.core.population import Population
from pymoo.core.problem import Problem
from pymoo.operators.survival.rank_and_crowding import RankAndCrowding

from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import Flown, SearchPlan
from pytest_garl.search.operators import nuclear_gene_crossover

Matrix = NDArray[np.float64]
Objectives = Callable[[Matrix, Sequence[Flown]], Matrix]
"""From normalised chromosomes (k, d) and their flights to objectives (k, m), all maximised."""
Mutation = Callable[[Matrix, Matrix, Matrix, np.random.Generator], Matrix]
"""From offspring (n, d), lower and upper bounds (d,) and a generator to mutated offspring."""
_TRIES = 100


class Nsga2:
    """A genetic search; objectives and mutation make the method.

    ``width`` is the number of objectives.  A scenario's own seed is inherited with the tail
    of the chromosome, where the objects are: what they do by chance is part of what a parent
    was selected for.
    """

    learns = True

    def __init__(
        self, name: str, plan: SearchPlan, objectives: Objectives, width: int, mutation: Mutation
    ) -> None:
        self._plan, self._objectives, self._mutation = plan, objectives, mutation
        place = hashlib.sha256(f"{name} {plan.map.name}".encode()).digest()
        sequence = np.random.SeedSequence(plan.seed, spawn_key=(int.from_bytes(place[:4], "big"),))
        variation, survival = sequence.spawn(2)
        self._rng = np.random.default_rng(variation)
        self._seeds: dict[bytes, int] = {}
        self._flown: dict[bytes, Flown] = {}
        self._asked: Any = None
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
        self._asked = self._algorithm.ask()
        return [
            decode(
                row,
                self._plan.genome,
                map=self._plan.map.name,
                seed=self._seeds[row.tobytes()],
            )
            for row in self._asked.get("X")
        ]

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        """Learn from the generation; survivors are the best of parents and offspring."""
        rows = self._asked.get("X")
        for row, item in zip(rows, flown, strict=True):
            self._flown[row.tobytes()] = item
        values = self.values(rows)
        self._asked.set("F", -values)
        self._algorithm.tell(infills=self._asked)
        return [tuple(float(value) for value in row) for row in values]

    def values(self, rows: Matrix) -> Matrix:
        """Return the objectives of flown chromosomes, each measured against all the others."""
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
        """Repair a chromosome; mutate one that came before until it is new."""
        genome, map = self._plan.genome, self._plan.map
        for _ in range(_TRIES):
            mended = encode(repair(decode(row, genome, map=map.name, seed=0), map), genome)
            key = mended.tobytes()
            if key not in self._seeds:
                self._seeds[key] = seed
                return mended
            row = self._mutate(row[None])[0]
        return self._valid(genome.random(self._rng), seed)


class _Mating(InfillCriterion):  # type: ignore[misc]
    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def do(self, problem: Any, pop: Any, n_offsprings: int, **_: Any) -> Any:
        return Population.new("X", self._search.offspring(pop.get("X")))


class _Survival(RankAndCrowding):  # type: ignore[misc]
    """Rank and crowding over objectives measured anew in the union of P and O."""

    def __init__(self, search: Nsga2) -> None:
        super().__init__()
        self._search = search

    def _do(self, problem: Any, pop: Any, *args: Any, **kwargs: Any) -> Any:
        pop.set("F", -self._search.values(pop.get("X")))
        return super()._do(problem, pop, *args, **kwargs)
