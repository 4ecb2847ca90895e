"""Near misses as parents: parts that ``garl`` had, and does without because it measured better."""

from __future__ import annotations

from collections import Counter

import numpy as np
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from pytest_garl.execution.result import FlightResult
from pytest_garl.search.archive import Archive, Entry
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.objectives import BODIES, nearness_of
from pytest_garl.search.operators import Matrix

NEAR = "near "
"""Begins the name of a cell of near misses."""
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
FRONT = "front"


def near_misses(result: FlightResult) -> dict[str, float]:
    """Return how near a flight came to each kind of failure that it did not show, 0 to 1.

    By the signature of a collision with the nearest body, and by the property else.  A flight that
    violates something, or in which nobody could have landed, shows nothing else.
    """
    verdict = result.verdict
    if verdict.violation or verdict.no_landing:
        return {}
    found: dict[str, float] = {}
    body = 0.0
    for margin in verdict.margins:
        if margin.property == "collision":
            continue
        nearness = nearness_of(margin)
        if margin.property in BODIES:
            body = max(body, nearness)
        elif nearness > 0:
            found[margin.property] = nearness
    if result.closest_call and body > 0:
        found[result.closest_call] = body
    return found


class NearMissArchive(Archive):
    """Has a cell for each kind of failure that was nearly reached, too.

    One objective per way to fail, as many-objective test generation has one per goal (Panichella
    et al. 2018, DynaMOSA).  A cell is closed when its kind is found.
    """

    def __init__(self, columns: Columns) -> None:
        super().__init__(columns)
        self._types: Counter[str] = Counter()

    def names(self) -> list[str]:
        """Return the cells to breed from: all but near misses of what was found."""
        return [name for name in super().names() if not self._is_answered(name)]

    def add(self, item: FlownScenario, row: Matrix) -> float:
        """Put a flight into its cells; return its success, 0 to 1."""
        success = super().add(item, row)
        self._types[item.result.signature.partition(":")[0]] += 1
        for name, nearness in near_misses(item.result).items():
            cell = f"{NEAR}{name}"
            nearest = -self.cells[cell][0].rank[0] if self.cells[cell] else 0.0
            if nearness > nearest + LEAST_PROGRESS and not self._is_answered(cell):
                success = max(success, PROGRESS_WORTH)
            self.insert(cell, item, row, (-nearness,))
        return success

    def _is_answered(self, name: str) -> bool:
        """Whether a near miss's kind of failure was found."""
        if not name.startswith(NEAR):
            return False
        target = name.removeprefix(NEAR)
        if target in ANSWERS:
            return all(self._types[each] for each in ANSWERS[target])
        return target in self.cells


class FrontArchive(NearMissArchive):
    """Breeds near misses from the first front of all objectives, as NSGA-II does."""

    def names(self) -> list[str]:
        """Return the cells of violations, and one for all near misses."""
        names = super().names()
        near = [FRONT] if any(name.startswith(NEAR) for name in names) else []
        return [name for name in names if not name.startswith(NEAR)] + near

    def parent(self, name: str, rng: np.random.Generator) -> Entry:
        """Return one of a cell's best flights, or one that no other near miss dominates."""
        if name != FRONT:
            return super().parent(name, rng)
        cells = [cell for cell in super().names() if cell.startswith(NEAR)]
        entries = [entry for cell in cells for entry in self.cells[cell]]
        found = [near_misses(entry.flown.result) for entry in entries]
        values = [[-each.get(cell.removeprefix(NEAR), 0.0) for cell in cells] for each in found]
        front = NonDominatedSorting().do(np.array(values), only_non_dominated_front=True)
        return entries[int(rng.choice(front))]
