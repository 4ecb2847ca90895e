"""The model of a landing system: it predicts from a chromosome how near each property comes.

A Gaussian process of second order over nuclear genes (Duvenaud, Nickisch and Rasmussen 2011,
"Additive Gaussian processes"): each gene that acts has an effect of its own, and each pair of
genes one more, because most faults take two conditions.  The covariance of two chromosomes is

    k(x, y) = sum of z_g(x, y) over genes g + PAIRS * sum of z_g(x, y) z_h(x, y) over g < h

in which z_g is 0 unless the gene acts in both, and else a constant plus the mean of a term for each
of its values: whether a choice is the same, how near two numbers are, and, for numbers that have a
harsher end, the product of their distances from nominal, by which the model extrapolates.  The
features come from the genome's columns; no gene is known by name.

All properties share the covariance, so that one inverse serves them all.  A sparse chromosome has
at most three genes that act, so that thousands of rows take milliseconds.

The same flights give the same bytes: sums have a fixed order, no BLAS or LAPACK is called, whose
order depends on threads and CPU, and only the four operations and square roots are used, which are
rounded alike everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.genes import ON_ABOVE
from pytest_garl.search.columns import Columns, Mask
from pytest_garl.search.objectives import BODIES, NEAREST_MISS, SAFE_MARGINS
from pytest_garl.search.operators import Matrix
from pytest_garl.verdicts.verdict import MarginName

PROPERTIES: tuple[MarginName, ...] = tuple(SAFE_MARGINS)
"""The properties whose margins have degrees: the columns of proximities."""
VIOLATED, FARTHEST = 1.2, -0.5
"""The proximity of a violated property, and the least one: wider margins are alike."""
MOST_FLIGHTS = 500
"""The model is fitted to at most this many latest flights: its time grows with their cube."""
ACTS = 0.2
"""Share of a gene's covariance that is due to its acting, whatever its values are."""
PAIRS = 0.25
NOISE = 1.0
"""Variance of what the model does not explain, as a share of that of a proximity."""
HARSHER = 5.0
"""Weight of the product of two distances from nominal, which extrapolates, beside nearness."""
WIDTH = 0.2
"""Two numbers that are farther apart than this share of their range tell nothing of each other."""
LEAST_SPREAD = 0.05
"""Least standard deviation of a proximity by which it is scaled."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What the model expects of m candidates.

    ``proximity`` (m, p) is that of each property, ``spread`` (m, p) its standard deviation,
    ``fails`` (m,) the probability of a violation and ``rarity`` (m,) how rare its kind will be.
    ``variance`` (m,) is what the model does not know, and ``likeness`` (m, n) says how like the n
    flights they are: 1 is alike, 0 nothing in common.
    """

    proximity: Matrix
    spread: Matrix
    fails: Matrix
    rarity: Matrix
    variance: Matrix
    likeness: Matrix


def proximities(result: FlightResult) -> Matrix:
    """Return how near a flight came to violating each property, shape (p,); from 1 on it did.

    If nobody could have landed, only the bodies that the UAV came near to count.
    """
    verdict = result.verdict
    values = {each.property: each.value for each in verdict.margins}
    most = VIOLATED if verdict.violation else NEAREST_MISS
    found = []
    for name, safe in SAFE_MARGINS.items():
        excused = verdict.no_landing == "excused" and name not in BODIES
        near = 0.0 if excused else 1 - values.get(name, safe) / safe
        if verdict.violation and name == verdict.primary:
            near = VIOLATED
        found.append(min(most, max(FARTHEST, near)))
    return np.array(found)


class MarginModel:
    """The model, fitted to n flights: chromosomes (n, d) and proximities (n, p).

    ``violates`` (n,) is 1 for a violation, ``rarity`` (n,) how rare its kind is among the flights.
    """

    def __init__(
        self,
        columns: Columns,
        rows: Matrix,
        proximity: Matrix,
        violates: Matrix,
        rarity: Matrix,
    ) -> None:
        self._columns = columns
        self._span = columns.upper - columns.lower
        self._rows = rows[-MOST_FLIGHTS:]
        self.first = len(rows) - len(self._rows)
        """The first flight that it is fitted to."""
        values = np.column_stack([proximity, violates, rarity])[self.first :]
        self._values = self._scaled(self._rows)
        covariance = self._covariance(self._rows, self._values, self._rows, self._values)
        self._norm = np.sqrt(np.diagonal(covariance))
        self._inverse = inverse(covariance + NOISE * np.eye(len(self._rows)))
        self._mean = values.mean(axis=0)
        self._spread = np.maximum(LEAST_SPREAD, values.std(axis=0))
        scaled = (values - self._mean) / self._spread
        self._weights = np.einsum("ij,jp->ip", self._inverse, scaled)

    def predict(self, rows: Matrix) -> Prediction:
        """Return what the model expects of chromosomes (m, d)."""
        values = self._scaled(rows)
        covariance = self._covariance(rows, values, self._rows, self._values)
        means = self._mean + self._spread * np.einsum("ij,jp->ip", covariance, self._weights)
        own = self._variance(rows, values)
        known = np.einsum("ij,ij->i", np.einsum("ij,jk->ik", covariance, self._inverse), covariance)
        variance = np.maximum(0.0, own - known)
        likeness = np.maximum(0.0, covariance) / (np.sqrt(own)[:, None] * self._norm)
        return Prediction(
            proximity=means[:, :-2],
            spread=np.sqrt(variance)[:, None] * self._spread[:-2],
            fails=np.clip(means[:, -2], 0.0, 1.0),
            rarity=np.clip(means[:, -1], 0.0, 1.0),
            variance=variance,
            likeness=likeness,
        )

    def likeness(self, rows: Matrix, others: Matrix) -> Matrix:
        """Return how like chromosomes (m, d) are others (n, d), shape (m, n)."""
        values, other = self._scaled(rows), self._scaled(others)
        covariance = self._covariance(rows, values, others, other)
        norms = np.sqrt(self._variance(rows, values)), np.sqrt(self._variance(others, other))
        found: Matrix = np.maximum(0.0, covariance) / (norms[0][:, None] * norms[1])
        return found

    def _scaled(self, rows: Matrix) -> Matrix:
        """Return the values as shares of their range from nominal, and choices as their number."""
        scaled = (rows - self._columns.nominal) / self._span
        chosen = self._columns.chosen
        scaled[:, chosen] = self._columns.numbers(rows)[:, chosen]
        return scaled

    def _acting(self, rows: Matrix) -> Sequence[tuple[Mask, range]]:
        """Return for each nuclear gene in which rows it acts, and the columns of its values."""
        return [
            (rows[:, gene.start] > ON_ABOVE, range(gene.start + 1, gene.stop))
            if gene.start in self._columns.bits
            else (np.ones(len(rows), dtype=bool), range(gene.start, gene.stop))
            for gene in self._columns.slices
        ]

    def _covariance(self, rows: Matrix, a: Matrix, others: Matrix, b: Matrix) -> Matrix:
        total, squares = np.zeros((2, len(rows), len(others)))
        acting = zip(self._acting(rows), self._acting(others), strict=True)
        for (here, columns), (there, _) in acting:
            first, second = np.flatnonzero(here), np.flatnonzero(there)
            if not first.size or not second.size:
                continue
            term = np.zeros((first.size, second.size))
            for column in columns:
                x, y = a[first, column][:, None], b[second, column][None, :]
                if self._columns.chosen[column]:
                    term += x == y
                else:
                    term += np.maximum(0.0, 1 - np.abs(x - y) / WIDTH)
                    if self._columns.outward[column]:
                        term += HARSHER * x * y
            term = ACTS + (1 - ACTS) / len(columns) * term
            place = np.ix_(first, second)
            total[place] += term
            squares[place] += term * term
        both: Matrix = total + PAIRS / 2 * (total * total - squares)
        return both

    def _variance(self, rows: Matrix, values: Matrix) -> Matrix:
        """Return the covariance of each row with itself."""
        total, squares = np.zeros((2, len(rows)))
        for here, columns in self._acting(rows):
            term = np.full(len(rows), float(len(columns)))
            for column in columns:
                if self._columns.outward[column] and not self._columns.chosen[column]:
                    term += HARSHER * values[:, column] * values[:, column]
            term = (ACTS + (1 - ACTS) / len(columns) * term) * here
            total += term
            squares += term * term
        both: Matrix = total + PAIRS / 2 * (total * total - squares)
        return both


def inverse(matrix: Matrix) -> Matrix:
    """Return the inverse of a positive definite matrix (n, n), by Gauss and Jordan.

    It needs no pivots: the noise on the diagonal keeps each of them away from 0.
    """
    left = matrix.copy()
    for index in range(len(left)):
        pivot = left[index, index]
        row, column = left[index] / pivot, left[:, index].copy()
        left -= column[:, None] * row[None, :]
        left[index], left[:, index] = row, -column / pivot
        left[index, index] = 1 / pivot
    return left


def share_above(value: Matrix, limit: float, spread: Matrix) -> Matrix:
    """Return a share, 0 to 1, that grows as values (m, p) exceed a limit by their spread.

    It stands for the probability of that, without exponentials.
    """
    away = (value - limit) / spread
    share: Matrix = 0.5 + 0.5 * away / (1 + np.abs(away))
    return share
