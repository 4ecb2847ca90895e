"""Sparse chromosomes: few optional genes are active, all others are nominal.

Most faults show with two or three interacting conditions (Kuhn, Wallace and Gallo 2004), and a
scenario in which little is unusual says what a failure is due to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pytest_garl.scenarios.genes import Genome, Property

COUNT_SHARES = (0.1, 0.3, 0.3, 0.3)
"""Shares of scenarios with 0, 1, 2 and 3 active genes."""
MOST_ACTIVE = len(COUNT_SHARES) - 1
"""Of a bred chromosome too: without it, five generations of the paper's operators make 8 of 18
groups active."""
OUTER_SHARE = 0.5
"""Share of the draws of a property that lie in the outer third of its range."""
ON, OFF = 0.75, 0.25
"""A bit of activity as it is drawn."""
ON_ABOVE = 0.5


def draw(
    genome: Genome, rng: np.random.Generator, names: Iterable[str] | None = None
) -> NDArray[np.float64]:
    """Draw a chromosome in which at most three optional genes are active, or all if dense.

    With ``names`` these are active.
    """
    optional = [gene.name for gene in genome.genes if gene.is_optional]
    active = {*optional} if names is None else {*names}
    if not genome.is_dense and names is None:
        count = min(int(rng.choice(len(COUNT_SHARES), p=COUNT_SHARES)), len(optional))
        active = {optional[index] for index in rng.choice(len(optional), size=count, replace=False)}
    row: list[float] = []
    for gene in genome.genes:
        is_active = not gene.is_optional or gene.name in active
        if gene.is_optional:
            row.append(ON if is_active else OFF)
        row += [_value(item, rng) if is_active else item.nominal for item in gene.values]
    return np.array(row)


def active_genes(genome: Genome, row: Mapping[str, float], seed: int) -> frozenset[str]:
    """Return the names of the optional genes that act: of those that are on, the three highest.

    So a bit of activity is a priority, and any operator breeds sparse scenarios.  The scenario's
    seed decides between equal ones, so that no gene is preferred for its place in the genome.  In a
    dense genome all that are on act.
    """
    priorities = {
        gene.name: row[gene.properties[0].key] for gene in genome.genes if gene.is_optional
    }
    names = [name for name, priority in priorities.items() if priority > ON_ABOVE]
    if len(names) > MOST_ACTIVE and not genome.is_dense:
        order = np.random.default_rng(seed).permutation(len(names))
        shuffled = [names[index] for index in order]
        names = sorted(shuffled, key=lambda name: -priorities[name])[:MOST_ACTIVE]
    return frozenset(names)


def _value(item: Property, rng: np.random.Generator) -> float:
    """Draw a value; of an outward property half lie in the third farthest from nominal."""
    if not item.outward:
        return float(rng.uniform(item.low, item.high))
    below, above = item.nominal - item.low, item.high - item.nominal
    side = above if rng.uniform(0, below + above) >= below else -below
    outer = rng.random() < OUTER_SHARE
    share = rng.uniform(2 / 3, 1.0) if outer else rng.uniform(0.0, 2 / 3)
    return min(item.high, max(item.low, float(item.nominal + side * share)))
