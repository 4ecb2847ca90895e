"""The archive: a cell for each way to fail.

MAP-Elites (Mouret and Clune 2015, "Illuminating search spaces by mapping elites").  A flight lies
in all of its cells: that of its violation, and that of each finding before its end.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import Severity
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.operators import Matrix

BEST = 3
"""A parent is one of so many best flights of its cell."""
FINDING_WORTH = 0.5
"""Success of the first flight in which something went wrong before its end: it is no violation
until a flight without NPCs shows it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A flight in a cell, with its chromosome; the least ``rank`` is the best of the cell."""

    flown: FlownScenario
    row: Matrix
    rank: tuple[float, ...]


class Archive:
    """The cells of one search."""

    def __init__(self, columns: Columns) -> None:
        self._columns = columns
        self.cells: defaultdict[str, list[Entry]] = defaultdict(list)
        self._seen: Counter[str] = Counter()

    def names(self) -> list[str]:
        """Return the cells to breed from."""
        return sorted(self.cells)

    def add(self, item: FlownScenario, row: Matrix) -> float:
        """Put a flight into its cells; return its success, 0 to 1."""
        result = item.result
        shown = [(finding.signature, FINDING_WORTH) for finding in result.verdict.findings]
        if result.verdict.violation:
            shown.append((result.signature, 1.0))
        worths = []
        for signature, worth in shown:
            self._seen[signature] += 1
            worths.append(worth / self._seen[signature])
            self.insert(signature, item, row, self._severity(result, row))
        return max(worths, default=0.0)

    def parent(self, name: str, rng: np.random.Generator) -> Entry:
        """Return one of the best flights of a cell."""
        best = self.cells[name][:BEST]
        return best[int(rng.integers(len(best)))]

    def insert(self, name: str, item: FlownScenario, row: Matrix, rank: tuple[float, ...]) -> None:
        """Put a flight into a cell, which keeps the best."""
        cell = self.cells[name]
        cell.append(Entry(flown=item, row=row, rank=rank))
        cell.sort(key=lambda each: each.rank)
        del cell[BEST:]

    def _severity(self, result: FlightResult, row: Matrix) -> tuple[float, ...]:
        """Return the order within the cell of a violation: least severe, nearest to nominal."""
        key = (result.severity or Severity()).key
        return (*key, self._columns.distance_from_nominal(row))
