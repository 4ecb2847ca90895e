"""Ways to breed a sparse chromosome: each changes few of the values that count."""

from __future__ import annotations

import numpy as np

from pytest_garl.scenarios.genes import OFF, ON
from pytest_garl.search.columns import Columns, Mask
from pytest_garl.search.exploration import Exploration
from pytest_garl.search.operators import Matrix, local_steps

STEP, HARDEN, SOFTEN, GRAFT, REDRAW = "step", "harden", "soften", "graft", "redraw"
WAYS = (STEP, HARDEN, SOFTEN, GRAFT, REDRAW)
"""Small steps; harsher values; milder values; a gene of another flight; one gene's values anew."""
STEP_SHARE = 0.5
"""Share of the values that count which a step changes."""
AIMED_SHARE = 0.8
"""Share of the steps that change only the NPC which the parent came nearest to, or hit."""
HARDEN_SHARE = 0.7
"""Share of the harsher values' way to the end of their range, at most, and of those that move."""
SOFTEN_SHARE = 0.6
"""Share of the way back to nominal, at most."""
LARGEST_STEP = 0.03
"""The largest standard deviation of a step, as a share of the value's range."""
PLACE_SHARE = 0.2
"""Share of children whose marker moves too."""


class Breeding:
    """The operators on chromosomes of one genome."""

    def __init__(self, columns: Columns, exploration: Exploration) -> None:
        self._columns, self._exploration = columns, exploration
        optional = {gene.name for gene in columns.optional}
        self._always = np.array([name not in optional for name in columns.owner])

    def child(
        self, way: str, row: Matrix, donor: Matrix, body: str, rng: np.random.Generator
    ) -> Matrix:
        """Return a child of ``row``.

        ``donor`` is the chromosome of another flight, ``body`` the NPC that ``row`` came nearest
        to, empty without one.
        """
        child = row
        if way == HARDEN:
            child = self._harden(row, rng)
        elif way == SOFTEN:
            child = self._soften(row, rng)
        elif way == GRAFT:
            child = self._graft(row, donor, body, rng)
        elif way == REDRAW:
            child = self._redraw(row, rng)
        # A way that changes nothing here is a step.
        if np.array_equal(child, row):
            child = self._step(row, body, rng)
        return child

    def _step(self, row: Matrix, body: str, rng: np.random.Generator) -> Matrix:
        columns = self._columns
        mask = columns.counting(row)
        if columns.optional and rng.random() >= PLACE_SHARE:
            mask &= ~self._always
        about = np.array([name == body for name in columns.owner])
        # The last centimetres to a body depend on that body.
        if about.any() and rng.random() < AIMED_SHARE:
            mask &= about
        if not mask.any():
            mask = columns.counting(row)
        moved = local_steps(
            row[None],
            columns.lower,
            columns.upper,
            rng,
            probability=STEP_SHARE,
            largest=LARGEST_STEP,
        )[0]
        child: Matrix = np.where(mask, moved, row)
        if np.array_equal(child, row):
            column = int(rng.choice(np.flatnonzero(mask)))
            step = rng.normal(0, LARGEST_STEP) * (columns.upper - columns.lower)[column]
            child[column] = np.clip(
                row[column] + step, columns.lower[column], columns.upper[column]
            )
        return child

    def _harsh(self, row: Matrix) -> Mask:
        harsh: Mask = self._columns.counting(row) & self._columns.outward & ~self._always
        return harsh

    def _harden(self, row: Matrix, rng: np.random.Generator) -> Matrix:
        columns, child = self._columns, row.copy()
        for column in np.flatnonzero(self._harsh(row)):
            low, high, nominal = (
                each[column] for each in (columns.lower, columns.upper, columns.nominal)
            )
            if rng.random() < HARDEN_SHARE:
                away = row[column] - nominal
                end = high if away > 0 or (away == 0 and high - nominal >= nominal - low) else low
                child[column] += rng.uniform(0, HARDEN_SHARE) * (end - child[column])
        return child

    def _soften(self, row: Matrix, rng: np.random.Generator) -> Matrix:
        child = row.copy()
        for column in np.flatnonzero(self._harsh(row)):
            back = self._columns.nominal[column] - row[column]
            child[column] += rng.uniform(0, SOFTEN_SHARE) * back
        return child

    def _graft(self, row: Matrix, donor: Matrix, body: str, rng: np.random.Generator) -> Matrix:
        """Return the row with one more gene of the donor; of too many, one goes."""
        columns = self._columns
        active = columns.active(row)
        new = [gene for gene in columns.active(donor) if gene not in active]
        if not new:
            return row.copy()
        gene, child = new[int(rng.integers(len(new)))], row.copy()
        if len(active) >= columns.limit:
            others = [each for each in active if each.name != body] or list(active)
            child[others[int(rng.integers(len(others)))].bit] = OFF
        child[gene.bit] = ON
        child[gene.values] = donor[gene.values]
        return child

    def _redraw(self, row: Matrix, rng: np.random.Generator) -> Matrix:
        """Return the row with other values of one gene that acts."""
        active = self._columns.active(row)
        if not active:
            return row.copy()
        gene = active[int(rng.integers(len(active)))]
        child = row.copy()
        child[gene.values] = self._exploration.values(gene, row, rng)
        return child
