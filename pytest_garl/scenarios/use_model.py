"""A model of use: how often each condition and NPC occurs, and the scenarios drawn from it.

The conditions occur independently of each other, each in its share of landings.  A value is drawn
between its limits: evenly, or with a most frequent value (triangular).  Values are drawn in the
units of genes, so that a visibility is even in the extinction and the sun over its day.  Unlike a
search, which flies at most three causes at once, use has as many as occur.

No one decides when an NPC or an event harms most: that is a search, and no use.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.genes import OFF, ON, Genome

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """How one value is distributed, in the units of genes.

    It lies between ``low`` and ``high``: evenly, or with the most frequent value ``peak``.  With
    ``weights`` it is a number from 0 on, as often as its weight says.  Half of the values lie
    mirrored at ``mirrored``, as the sun does after noon; None if none do.
    """

    low: float
    high: float
    peak: float | None = None
    weights: tuple[float, ...] = ()
    mirrored: float | None = None

    def at(self, levels: Matrix) -> Matrix:
        """Return the quantiles at ``levels``, each from 0 to 1, of any shape."""
        if self.weights:
            steps = np.cumsum(self.weights)
            steps /= steps[-1]
            # The last number with a weight, should rounding leave the sum below the level.
            last = int(np.flatnonzero(self.weights)[-1])
            numbers: Matrix = np.minimum(np.searchsorted(steps, levels, side="right"), last) + 0.0
            return numbers
        if self.mirrored is not None:
            half = dataclasses.replace(self, mirrored=None).at(np.mod(2 * levels, 1.0))
            return np.where(levels < 0.5, half, 2 * self.mirrored - half)
        width = self.high - self.low
        if self.peak is None or width == 0:
            return self.low + levels * width
        below, above = self.peak - self.low, self.high - self.peak
        rising = self.low + np.sqrt(levels * width * below)
        falling = self.high - np.sqrt((1 - levels) * width * above)
        return np.where(levels * width < below, rising, falling)


@dataclass(frozen=True, slots=True, kw_only=True)
class UseModel:
    """How often what occurs in the scenarios of one genome.

    ``genome`` is dense: in its scenarios all act that are drawn.  ``shares`` has the share of
    landings of each optional gene, ``spreads`` the distribution of each value that a gene has, both
    by key.
    """

    genome: Genome
    shares: dict[str, float]
    spreads: dict[str, Spread]

    def rows(self, count: int, rng: np.random.Generator) -> Matrix:
        """Draw chromosomes, shape (count, size)."""
        rows = np.empty((count, self.genome.size))
        levels = rng.random((count, self.genome.size))
        column = 0
        for gene in self.genome.genes:
            acts = np.ones(count, dtype=bool)
            if gene.is_optional:
                acts = levels[:, column] < self.shares[gene.name]
                rows[:, column] = np.where(acts, ON, OFF)
                column += 1
            for item in gene.values:
                drawn = self.spreads[item.key].at(levels[:, column])
                inside = np.clip(drawn, item.low, item.high)
                rows[:, column] = np.where(acts, inside, item.nominal)
                column += 1
        return rows
