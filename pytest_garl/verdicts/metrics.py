"""Figures over many flights: shares with their intervals, Top-K, distances, coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_garl.verdicts.verdict import PropertyName, Verdict

CELL_M = 2.0
"""Edge of a cell (paper, section 4.2.3: "2x2x2 meter cells")."""
HEIGHT_M = 30.0
"""Height of the volume that is covered: in the paper's code both maps are 15 cells high."""


def share_interval(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Exact (Clopper-Pearson) interval of a share, as fractions."""
    if total == 0:
        return 0.0, 1.0
    from scipy.stats import beta

    tail = (1 - level) / 2
    low = float(beta.ppf(tail, count, total - count + 1)) if count else 0.0
    high = float(beta.ppf(1 - tail, count + 1, total - count)) if count < total else 1.0
    return low, high


def decided(verdicts: Sequence[Verdict], name: PropertyName) -> int:
    """Return in how many flights a property was decided: held or violated for sure."""
    return sum(
        margin.decided
        for verdict in verdicts
        for margin in verdict.margins
        if margin.property == name
    )


def decided_words(verdicts: Sequence[Verdict]) -> str:
    """Say what flights decided, as "distance decided in 4 of 60 flights, time in 12"."""
    return (
        f"distance decided in {decided(verdicts, 'distance')} of {len(verdicts)} flights, "
        f"time in {decided(verdicts, 'time')}"
    )


def top_k(verdicts: Sequence[Verdict], k: int = 10) -> int | None:
    """How many flights it took to find the first ``k`` violations; None if there are fewer."""
    found = 0
    for index, verdict in enumerate(verdicts, start=1):
        found += verdict.paper_violation
        if found == k:
            return index
    return None


def mean_distance(vectors: NDArray[np.float64]) -> float:
    """Return the mean Euclidean distance between scenarios (paper, "parameter distance").

    ``vectors`` is (n, d).  As in the paper's equation the mean is over all n² ordered pairs, each
    scenario's distance of 0 to itself among them.
    """
    from scipy.spatial.distance import pdist

    count = len(vectors)
    return 2 * float(pdist(vectors).sum()) / count**2 if count else 0.0


def no_cells(bounds_m: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Return the cells of a map's volume, none of them visited: booleans over (x, y, z).

    ``bounds_m`` is (x_min, x_max, y_min, y_max).  A cell that sticks out of the map counts as one.
    """
    x_min, x_max, y_min, y_max = bounds_m
    extents_m = (x_max - x_min, y_max - y_min, HEIGHT_M)
    return np.zeros([math.ceil(extent / CELL_M) for extent in extents_m], dtype=bool)


def visit(
    cells: NDArray[np.bool_],
    position_m: NDArray[np.float64],
    bounds_m: tuple[float, float, float, float],
) -> None:
    """Mark the cells in which a track's positions (n, 3) lie; outside of the volume is nowhere.

    At 24 positions a second a UAV moves a tenth of a cell between two of them.
    """
    origin = (bounds_m[0], bounds_m[2], 0.0)
    indices = np.floor((position_m - origin) / CELL_M).astype(int)
    inside = ((indices >= 0) & (indices < cells.shape)).all(axis=1)
    cells[tuple(indices[inside].T)] = True
