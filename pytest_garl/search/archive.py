"""The archive: a cell for each way to fail, and one for each way that was nearly reached.

MAP-Elites (Mouret and Clune 2015, "Illuminating search spaces by mapping elites") with one
objective per way to fail, as many-objective test generation has one per goal (Panichella et al.
2018, DynaMOSA).  A flight lies in all of its cells: that of its violation; that of each finding
before its end; that of each property which it nearly violated; or that of flights in which nobody
could have seen the marker.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import Severity
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.objectives import near_misses
from pytest_garl.search.operators import Matrix

EXCUSED = "excused"
"""The cell of flights in which nobody could have landed."""
NEAR = "near "
"""Begins the name of a cell of near misses."""
BEST = 3
"""A parent is one of so many best flights of its cell."""
FINDING_WORTH = 0.5
"""Success of the first flight in which something went wrong before its end: it is no violation
until a flight without NPCs shows it."""
PROGRESS_WORTH = 0.5
"""Success of a flight that comes nearer to a kind of failure that was not found yet."""
LEAST_PROGRESS = 0.02
"""A flight comes nearer to a failure if it raises the proximity by this much."""
ANSWERS = {
    "distance": ("off", "I", "slid"),
    "tracking": ("off", "I"),
    "time": ("late",),
    "touchdown_speed": ("hard",),
    "touchdown_tilt": ("hard",),
    "dropout": ("II",),
    "decoy": ("I",),
    "slide": ("slid",),
}
"""The types of violation that a near miss of a property would become."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A flight in a cell, with its chromosome; the least ``rank`` is the best of the cell."""

    flown: FlownScenario
    row: Matrix
    rank: tuple[float, ...]


class Archive:
    """The cells of one search."""

    def __init__(self, columns: Columns, *, has_near: bool = True) -> None:
        self._columns, self._has_near = columns, has_near
        self.cells: defaultdict[str, list[Entry]] = defaultdict(list)
        self._seen: Counter[str] = Counter()
        self._types: Counter[str] = Counter()

    def names(self) -> list[str]:
        """Return the cells to breed from: all but near misses of what was found."""
        return sorted(name for name in self.cells if not self._is_answered(name))

    def add(self, item: FlownScenario, row: Matrix) -> float:
        """Put a flight into its cells; return its success, 0 to 1."""
        result = item.result
        shown = [(finding.signature, FINDING_WORTH) for finding in result.verdict.findings]
        if result.verdict.violation:
            shown.append((result.signature, 1.0))
            self._types[result.signature.partition(":")[0]] += 1
        worths = []
        for signature, worth in shown:
            self._seen[signature] += 1
            worths.append(worth / self._seen[signature])
            self._insert(signature, item, row, self._severity(result, row))
        if result.verdict.no_landing == "excused":
            self._insert(EXCUSED, item, row, (self._columns.distance_from_nominal(row),))
        for name, nearness in near_misses(result).items() if self._has_near else ():
            cell = f"{NEAR}{name}"
            nearest = -self.cells[cell][0].rank[0] if self.cells[cell] else 0.0
            if nearness > nearest + LEAST_PROGRESS and not self._is_answered(cell):
                worths.append(PROGRESS_WORTH)
            self._insert(cell, item, row, (-nearness,))
        return max(worths, default=0.0)

    def parent(self, name: str, rng: np.random.Generator) -> Entry:
        """Return one of the best flights of a cell."""
        best = self.cells[name][:BEST]
        return best[int(rng.integers(len(best)))]

    def _is_answered(self, name: str) -> bool:
        """Whether a near miss's kind of failure was found."""
        if not name.startswith(NEAR):
            return False
        target = name.removeprefix(NEAR)
        if target in ANSWERS:
            return all(self._types[each] for each in ANSWERS[target])
        return self._seen[target] > 0

    def _insert(self, name: str, item: FlownScenario, row: Matrix, rank: tuple[float, ...]) -> None:
        cell = self.cells[name]
        cell.append(Entry(flown=item, row=row, rank=rank))
        cell.sort(key=lambda each: each.rank)
        del cell[BEST:]

    def _severity(self, result: FlightResult, row: Matrix) -> tuple[float, ...]:
        """Return the order within the cell of a violation: least severe, nearest to nominal."""
        key = (result.severity or Severity()).key
        return (*key, self._columns.distance_from_nominal(row))
