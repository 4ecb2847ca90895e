"""The paper's variation operators (Algorithm 1) as functions of arrays.

A generation is a matrix: one chromosome a row, one property a column, in gene units.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Choice = Callable[[Matrix, Matrix], int]
"""Given candidates (m,) and a property's values in the generation (k,), the index to take."""

CROSSOVER_PROBABILITY = 0.2
MUTATION_PROBABILITY = 0.2
CANDIDATES = 10
"""Paper, supplement: both rates 0.2 and ten candidates.  Its Algorithm 1 varies where
``r > threshold``; the thresholds are read as 1 - rate, as its published code does."""


def nuclear_gene_crossover(
    parents: Matrix,
    borders: Sequence[int],
    rng: np.random.Generator,
    probability: float = CROSSOVER_PROBABILITY,
) -> Matrix:
    """Return offspring (n, d) of parents (n, d): adjacent pairs swap their tails.

    Rows 0 and 1 are a pair, 2 and 3 the next; the last of an odd number is copied.
    ``borders`` are the columns at which a nuclear gene begins, without 0; one of them is
    drawn for each pair, so that no nuclear gene is ever torn.
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

    The sum is convex in the candidate, so the winner lies at an end of the range nearly
    always.
    """
    return int(np.argmax(np.abs(candidates[:, None] - values[None, :]).sum(axis=1)))


def farthest_from_nearest(candidates: Matrix, values: Matrix) -> int:
    """Index of the candidate whose nearest neighbour among ``values`` is farthest (maximin)."""
    return int(np.argmax(np.abs(candidates[:, None] - values[None, :]).min(axis=1)))


def property_mutation(
    offspring: Matrix,
    lower: Matrix,
    upper: Matrix,
    rng: np.random.Generator,
    *,
    probability: float = MUTATION_PROBABILITY,
    candidates: int = CANDIDATES,
    choose: Choice = farthest_from_all,
) -> Matrix:
    """Return a copy of ``offspring`` in which each property mutates with ``probability``.

    A mutating property draws ``candidates`` values uniformly from its range and takes
    the one that ``choose`` prefers, given that property's values in the generation as it
    stands at that moment: earlier rows have mutated already, as in Algorithm 1.
    """
    mutated = offspring.copy()
    rows, columns = mutated.shape
    for row in range(rows):
        for column in range(columns):
            if rng.random() < probability:
                drawn = rng.uniform(lower[column], upper[column], candidates)
                mutated[row, column] = drawn[choose(drawn, mutated[:, column])]
    return mutated


LOCAL_STEP = 0.1
"""Standard deviation of a local step, as a share of the property's range."""


def local_steps(
    offspring: Matrix,
    lower: Matrix,
    upper: Matrix,
    rng: np.random.Generator,
    *,
    probability: float = MUTATION_PROBABILITY,
) -> Matrix:
    """Return a copy in which each property moves a little with ``probability``."""
    steps = rng.normal(0.0, LOCAL_STEP, offspring.shape) * (upper - lower)
    moved = np.where(rng.random(offspring.shape) < probability, offspring + steps, offspring)
    return np.clip(moved, lower, upper)
