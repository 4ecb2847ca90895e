"""Scenarios without parents, of a stratum: a few of the optional genes act."""

from __future__ import annotations

import numpy as np

from pytest_garl.search.columns import STRATA, Columns, OptionalGene
from pytest_garl.search.operators import Matrix

LONE_NPC_SHARE = 0.8
"""Share of scenarios with NPCs that have one: it says more than two, and severity counts it."""
DRAWS = 3
"""Draws of a condition's values of which the harshest are flown: mild ones seldom show anything."""


class Exploration:
    """Draws scenarios without parents."""

    def __init__(self, columns: Columns) -> None:
        self._columns = columns

    def new(self, stratum: str, rng: np.random.Generator) -> Matrix:
        """Return a chromosome of a stratum."""
        columns = self._columns
        row = columns.genome.random(rng)
        if not columns.optional:
            return row
        names = self.names(stratum, rng)
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
        """Return a chromosome in which a gene acts; the values of a condition are harsh."""
        draws = 1 if gene.is_npc else DRAWS
        drawn = [self._columns.genome.random_active(rng, (gene.name,)) for _ in range(draws)]
        return max(drawn, key=lambda row: self._columns.harshness(row, gene))

    def names(self, stratum: str, rng: np.random.Generator) -> tuple[str, ...]:
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
