"""garl: a search that takes every way to fail as seriously as any other.

MAP-Elites (Mouret and Clune 2015, "Illuminating search spaces by mapping elites") with the
paper's chromosomes and crossover.  A cell is a way to fail: a violation's signature, or that which
a near miss would have had.  Each cell is bred from as often as any other, from its worst flights,
so that the twentieth violation of a kind takes nothing from the first of another.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.objectives import threat
from pytest_garl.search.operators import (
    CROSSOVER_PROBABILITY,
    MUTATION_PROBABILITY,
    Matrix,
    local_steps,
    nuclear_gene_crossover,
)

EXPLORES = 0.25
"""Share of scenarios that have no parents, so that cells are still found late in a search."""
AIMS = 0.5
"""Share of children that differ from a parent in nothing but the object that it came nearest to:
what decides whether centimetres are missing."""


class Garl:
    """The archive of cells, and how it is bred from.

    ``explores`` is the share of scenarios without parents, ``aims`` that of children whose
    steps are aimed, ``crossover`` the paper's probability for the others, ``cell`` names the
    cell of a flight's result.
    """

    learns = True

    def __init__(
        self,
        plan: Plan,
        *,
        explores: float = EXPLORES,
        aims: float = AIMS,
        crossover: float = CROSSOVER_PROBABILITY,
        cell: Callable[[dict[str, Any]], str] | None = None,
    ) -> None:
        self._plan, self._explores, self._aims = plan, explores, aims
        self._crossover = crossover
        self._cell = cell or cell_of
        place = hashlib.sha256(f"garl {plan.map.name}".encode()).digest()
        key = int.from_bytes(place[:4], "big")
        self._rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(key,)))
        self._cells: defaultdict[str, list[Flown]] = defaultdict(list)
        self._bred: Counter[str] = Counter()
        self._asked: set[tuple[tuple[str, float], ...]] = set()

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        return [self._new() for _ in range(self._plan.population)]

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        """Put each flight into its cell; return its threat."""
        for item in flown:
            self._cells[self._cell(item.result)].append(item)
        return [(threat(item.result),) for item in flown]

    def _new(self) -> Scenario:
        """Return a scenario that was not asked for before."""
        while True:
            explores = not self._cells or self._rng.random() < self._explores
            scenario = self._random() if explores else self._child()
            if scenario.genes not in self._asked:
                self._asked.add(scenario.genes)
                return scenario

    def _random(self) -> Scenario:
        row = self._plan.genome.random(self._rng)
        return self._scenario(row, int(self._rng.integers(2**32)))

    def _child(self) -> Scenario:
        """Return a child of a flight from the cell that was bred from least.

        A scenario's own seed is inherited with the tail of the chromosome, where the objects
        are: what they do by chance is part of what a parent was selected for.
        """
        rng, genome = self._rng, self._plan.genome
        names = sorted(self._cells)
        least = min(self._bred[name] for name in names)
        name = str(rng.choice([name for name in names if self._bred[name] == least]))
        self._bred[name] += 1
        pair = [self._elite(name), self._elite(str(rng.choice(names)))]
        rows = np.array([[*encode(each.scenario, genome), each.scenario.seed] for each in pair])
        aim = np.array(
            [key.startswith(f"{pair[0].result['closest_body']}.") for key in genome.keys]
        )
        aims = rng.random() < self._aims and aim.any()
        if not aims:
            rows = nuclear_gene_crossover(rows, genome.borders, rng, self._crossover)
        parent = rows[:1, :-1]
        moved = local_steps(
            parent,
            genome.lower,
            genome.upper,
            rng,
            probability=1.0 if aims else MUTATION_PROBABILITY,
        )
        return self._scenario(np.where(aim | (not aims), moved, parent)[0], int(rows[0, -1]))

    def _elite(self, name: str) -> Flown:
        """Return one of a cell's flights that came nearest to a violation, or violated."""
        cell = self._cells[name]
        most = max(threat(item.result) for item in cell)
        elites = [item for item in cell if threat(item.result) == most]
        return elites[int(self._rng.integers(len(elites)))]

    def _scenario(self, row: Matrix, seed: int) -> Scenario:
        plan = self._plan
        return repair(decode(row, plan.genome, map=plan.map.name, seed=seed), plan.map)


def cell_of(result: dict[str, Any]) -> str:
    """Return how a flight failed or nearly did: a signature, or the outcome."""
    return str(result["verdict"]["signature"] or result["closest_call"] or result["outcome"])
