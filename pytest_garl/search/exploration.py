"""Scenarios without parents: pairs of optional genes early, values away from earlier ones.

Most faults show with two interacting conditions (Kuhn, Wallace and Gallo 2004), so that a scenario
switches on the genes whose pairs were flown least.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable

import numpy as np

from pytest_garl.search.columns import STRATA, Columns, OptionalGene
from pytest_garl.search.operators import Matrix, farthest_from_nearest

SETS = 12
"""Sets of genes of which the one with the most new pairs is taken."""
CANDIDATES = 4
"""Draws of a gene's values of which the one farthest from all earlier ones is taken."""
LONE_NPC_SHARE = 0.8
"""Share of scenarios with NPCs that have one: it says more than two, and severity counts it."""


class Exploration:
    """Draws scenarios without parents, and remembers what was flown."""

    def __init__(self, columns: Columns, *, covers: bool = True) -> None:
        self._columns, self._covers = columns, covers
        self._pairs: Counter[tuple[str, str]] = Counter()
        self._values: defaultdict[str, list[Matrix]] = defaultdict(list)

    def note(self, row: Matrix) -> None:
        """Take in a scenario that will be flown."""
        active = self._columns.active(row)
        self._pairs.update(_pairs(gene.name for gene in active))
        for gene in active:
            self._values[gene.name].append(self._shares(row, gene))

    def new(self, stratum: str, rng: np.random.Generator) -> Matrix:
        """Return a chromosome of a stratum."""
        columns = self._columns
        row = columns.genome.random(rng)
        if not columns.optional:
            return row
        sets = [self._names(stratum, rng) for _ in range(SETS if self._covers else 1)]
        pairs = [sum(1 / (1 + self._pairs[pair]) for pair in _pairs(names)) for names in sets]
        names = sets[int(np.argmax(pairs))]
        row = columns.with_active(row, names)
        for gene in columns.optional:
            if gene.name in names:
                row[gene.values] = self.values(gene, rng)[gene.values]
            if gene.is_npc and gene.name in names and gene.grade >= 0:
                low, high = (0.0, 1.0) if stratum == STRATA[1] else (1.0, columns.upper[gene.grade])
                top = np.nextafter(min(high, columns.upper[gene.grade]), low)
                row[gene.grade] = rng.uniform(low, top) if top > low else low
        return row

    def values(self, gene: OptionalGene, rng: np.random.Generator) -> Matrix:
        """Return a chromosome in which a gene has values away from all with which it acted."""
        genome = self._columns.genome
        drawn = [genome.random_active(rng, (gene.name,)) for _ in range(CANDIDATES)]
        earlier = self._values[gene.name]
        if not earlier:
            return drawn[0]
        shares = np.array([self._shares(row, gene) for row in drawn])
        return drawn[farthest_from_nearest(shares, np.array(earlier))]

    def _shares(self, row: Matrix, gene: OptionalGene) -> Matrix:
        low, high = self._columns.lower[gene.values], self._columns.upper[gene.values]
        shares: Matrix = (row[gene.values] - low) / (high - low)
        return shares

    def _names(self, stratum: str, rng: np.random.Generator) -> tuple[str, ...]:
        """Return a random set of genes of a stratum, as many as may act."""
        columns = self._columns
        npcs = [gene.name for gene in columns.optional if gene.is_npc]
        others = [gene.name for gene in columns.optional if not gene.is_npc]
        size = min(columns.limit, len(others) + len(npcs) * (stratum != STRATA[0]))
        count = 0
        if stratum != STRATA[0]:
            count = 1 if rng.random() < LONE_NPC_SHARE else min(2, len(npcs), size)
        chosen = [npcs[index] for index in rng.choice(len(npcs), count, replace=False)]
        left = min(size - count, len(others))
        drawn = [others[index] for index in rng.choice(len(others), left, replace=False)]
        return (*chosen, *drawn)


def _pairs(names: Iterable[str]) -> list[tuple[str, str]]:
    return list(itertools.combinations(sorted(names), 2))
