"""The paper's metrics of a search: Top-K, parameter distance, coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pytest_garl.verdicts.verdict import Verdict

CELL_M = 2.0
"""Edge of a cell (paper, section 4.2.3: "2x2x2 meter cells")."""
HEIGHT_M = 30.0
"""Height of the volume: in the paper's code both maps are 15 cells high."""


def top_k(verdicts: Sequence[Verdict], k: int = 10, *, by_the_paper: bool = True) -> int | None:
    """Return how many flights found the first ``k`` violations; None if there are fewer.

    Violations are those of the paper's definition, or those by the run's own limits.
    """
    found = 0
    for index, verdict in enumerate(verdicts, start=1):
        found += verdict.paper_violation if by_the_paper else verdict.violation
        if found == k:
            return index
    return None


def mean_distance(vectors: NDArray[np.float64]) -> float:
    """Return the mean Euclidean distance between scenarios (paper, "parameter distance").

    ``vectors`` is (n, d).  As in the paper's equation, the mean is taken over all n² ordered pairs;
    these include the distance of 0 between each scenario and itself.
    """
    from scipy.spatial.distance import pdist

    count = len(vectors)
    return 2 * float(pdist(vectors).sum()) / count**2 if count else 0.0


def empty_cells(bounds_m: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Return the cells of a map's volume as booleans over (x, y, z), all of them False.

    ``bounds_m`` is (x_min, x_max, y_min, y_max).  A cell that lies partly outside of the map counts
    as a whole one.
    """
    x_min, x_max, y_min, y_max = bounds_m
    extents_m = (x_max - x_min, y_max - y_min, HEIGHT_M)
    return np.zeros([math.ceil(extent / CELL_M) for extent in extents_m], dtype=bool)


def mark_visited(
    cells: NDArray[np.bool_],
    position_m: NDArray[np.float64],
    bounds_m: tuple[float, float, float, float],
) -> None:
    """Set the cells in which a track's positions (n, 3) lie; ignore positions outside.

    The track has 24 positions a second.  Between two of them a UAV moves a tenth of a cell.
    """
    origin = (bounds_m[0], bounds_m[2], 0.0)
    indices = np.floor((position_m - origin) / CELL_M).astype(int)
    inside = ((indices >= 0) & (indices < cells.shape)).all(axis=1)
    cells[tuple(indices[inside].T)] = True
