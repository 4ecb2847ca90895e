"""The columns of a genome as a search sees them: which gene, which act, which are harsher."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.genes import MOST_ACTIVE, OFF, ON, ON_ABOVE, Genome, NuclearGene
from pytest_garl.scenarios.story import GRADES, STORY
from pytest_garl.search.operators import Matrix

Mask = NDArray[np.bool_]
NOBODY, CARELESS, INTERFERING = "nobody", "careless", "interfering"
STRATA = (NOBODY, CARELESS, INTERFERING)
"""Scenarios without NPCs, with careless ones, and with one that knows of the UAV."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OptionalGene:
    """An optional gene: its columns, and what is special about it.

    ``bit`` is the column of its bit of activity, ``values`` those behind it.  ``grade_column`` is
    that of an NPC's grade, ``begins_column`` that of an event's begin, ``after_column`` that of the
    moment from which this counts, ``lasts_column`` that of how long it lasts, ``place_column`` that
    of a decoy's place to the east, before that to the north; -1 without one.
    """

    name: str
    bit: int
    values: slice
    is_npc: bool
    grade_column: int = -1
    begins_column: int = -1
    after_column: int = -1
    lasts_column: int = -1
    place_column: int = -1


class Columns:
    """The columns of one genome.

    ``outward`` are those whose values are harsher the farther they lie from nominal, ``chosen``
    those that are flown as whole numbers.  ``owner`` is the name of each column's gene, ``slices``
    are the columns of each nuclear gene, ``optional`` the genes with a bit of activity, ``bits``
    the columns of these bits.
    """

    def __init__(self, genome: Genome) -> None:
        self.genome = genome
        self.lower, self.upper, self.nominal = genome.lower, genome.upper, genome.nominal
        self.outward: Mask = np.array([not item.even for item in genome.properties])
        self._whole: Mask = np.array([item.whole for item in genome.properties])
        choices = [len(item.choices) for item in genome.properties]
        self.chosen: Mask = self._whole | (np.array(choices) > 0)
        self._last = np.array([float(count - 1) if count else np.inf for count in choices])
        self._of_story: Mask = np.array([key.partition(".")[2] in STORY for key in genome.keys])
        self.owner = tuple(gene.name for gene in genome.genes for _ in gene.properties)
        firsts = [0, *genome.borders]
        self.slices = tuple(
            slice(first, first + len(gene.properties))
            for gene, first in zip(genome.genes, firsts, strict=True)
        )
        self.optional = tuple(
            _optional_gene(gene, first)
            for gene, first in zip(genome.genes, firsts, strict=True)
            if gene.is_optional
        )
        self.bits = frozenset(gene.bit for gene in self.optional)

    def numbers(self, rows: Matrix) -> Matrix:
        """Return the numbers that chromosomes (m, d) fly in the ``chosen`` columns."""
        rounded = np.where(self._of_story, np.floor(rows), np.ceil(rows))
        found: Matrix = np.minimum(np.where(self._whole, np.round(rows), rounded), self._last)
        return found

    @property
    def limit(self) -> int:
        """The most optional genes that act at once."""
        return len(self.optional) if self.genome.is_dense else MOST_ACTIVE

    @property
    def strata(self) -> tuple[str, ...]:
        """The strata that the genome has; none without optional genes."""
        npcs = [gene for gene in self.optional if gene.is_npc]
        found = [NOBODY] if len(npcs) < len(self.optional) else []
        grades = [self.upper[gene.grade_column] for gene in npcs if gene.grade_column >= 0]
        found += [CARELESS] if npcs else []
        found += [INTERFERING] if any(each > 1 for each in grades) else []
        return tuple(found)

    def active(self, row: Matrix) -> tuple[OptionalGene, ...]:
        """Return the optional genes whose bit is on."""
        return tuple(gene for gene in self.optional if row[gene.bit] > ON_ABOVE)

    def with_active(self, row: Matrix, names: tuple[str, ...]) -> Matrix:
        """Return a copy in which exactly these optional genes are on."""
        changed = row.copy()
        for gene in self.optional:
            changed[gene.bit] = ON if gene.name in names else OFF
        return changed

    def stratum(self, row: Matrix) -> str:
        """Return the stratum of a row."""
        npcs = [gene for gene in self.active(row) if gene.is_npc]
        if not npcs:
            return NOBODY
        # An NPC without a grade is moved by a policy that knows of the UAV.
        grades = [row[npc.grade_column] if npc.grade_column >= 0 else len(GRADES) for npc in npcs]
        return CARELESS if max(grades) < 1 else INTERFERING

    def harshness(self, values: Matrix, gene: OptionalGene) -> float:
        """Return how far a gene's outward values lie from nominal: the sum of shares of ranges."""
        span = (self.upper - self.lower)[gene.values]
        shares = np.abs(values - self.nominal[gene.values]) / span
        return float(np.sum(shares[self.outward[gene.values]]))


def _optional_gene(gene: NuclearGene, first: int) -> OptionalGene:
    keys = [item.key for item in gene.properties]

    def column(name: str) -> int:
        key = f"{gene.name}.{name}"
        return first + keys.index(key) if key in keys else -1

    return OptionalGene(
        name=gene.name,
        bit=first,
        values=slice(first + 1, first + len(keys)),
        is_npc=f"{gene.name}.velocity" in keys,
        grade_column=column("grade"),
        begins_column=column("from_s"),
        after_column=column("after"),
        lasts_column=column("lasts_s"),
        # A domain may take away one of the two.
        place_column=column("x_m") if column("y_m") >= 0 else -1,
    )
