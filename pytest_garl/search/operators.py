"""The paper's variation operators (Algorithm 1) as functions of arrays.

A generation is a matrix: one chromosome a row, one property a column, in gene units.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

CROSSOVER_PROBABILITY = 0.2
MUTATION_PROBABILITY = 0.2
CANDIDATES = 10
"""Paper, supplement: both rates 0.2 and ten candidates.  Algorithm 1 varies a gene if
``r > threshold``; the thresholds are read as 1 - rate, as in the published code."""


def nuclear_gene_crossover(
    parents: Matrix,
    borders: Sequence[int],
    rng: np.random.Generator,
    probability: float = CROSSOVER_PROBABILITY,
) -> Matrix:
    """Return offspring (n, d) of parents (n, d): adjacent pairs swap their tails.

    Rows 0 and 1 are a pair, 2 and 3 the next; the last of an odd number is copied.
    ``borders`` are the columns at which a nuclear gene begins, without 0.  One of them is drawn
    for each pair, so that crossover never divides a nuclear gene.
    """
    offspring = parents.copy()
    for first in range(0, len(parents) - 1, 2):
        if rng.random() < probability:
            cut = int(rng.choice(borders))
            offspring[first, cut:] = parents[first + 1, cut:]
            offspring[first + 1, cut:] = parents[first, cut:]
    return offspring


def farthest_from_all(candidates: Matrix, values: Matrix) -> int:
    """Index of the candidate with the largest sum of distances to ``values`` (paper, eq. 2).

    The sum is convex in the candidate, so the winner nearly always lies at an end of the range.
    """
    return int(np.argmax(np.abs(candidates[:, None] - values[None, :]).sum(axis=1)))


def property_mutation(
    offspring: Matrix,
    lower: Matrix,
    upper: Matrix,
    rng: np.random.Generator,
    *,
    probability: float = MUTATION_PROBABILITY,
    candidates: int = CANDIDATES,
) -> Matrix:
    """Return a copy of ``offspring`` in which each property mutates with ``probability``.

    A mutating property draws ``candidates`` values uniformly from its range and takes the one
    farthest from all current values of that property in the generation.  Earlier rows have mutated
    already, as in Algorithm 1.
    """
    mutated = offspring.copy()
    rows, columns = mutated.shape
    for row in range(rows):
        for column in range(columns):
            if rng.random() < probability:
                drawn = rng.uniform(lower[column], upper[column], candidates)
                mutated[row, column] = drawn[farthest_from_all(drawn, mutated[:, column])]
    return mutated
