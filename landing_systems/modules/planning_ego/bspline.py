"""Uniform cubic B-splines: evaluation, derivatives, fitting to states and samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
FIXED = 3
"""Control points at each end that a state (position, velocity, acceleration) determines."""
_BASIS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6
"""Rows: powers of the share of the knot span; columns: the span's four control points."""
_FALLING = ((1, 1, 1, 1), (0, 1, 2, 3), (0, 0, 2, 6))
"""Factors of the powers after none, one and two derivations."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UniformSpline:
    """Control points (n, 3) in metres, n >= 4, and the time of one knot span."""

    points: Array
    span_s: float

    @property
    def duration_s(self) -> float:
        """Time from the curve's start to its end."""
        return (len(self.points) - 3) * self.span_s

    def evaluate(self, time_s: ArrayLike, derivative: int = 0) -> Array:
        """Return the position, velocity (1) or acceleration (2) at times from the start.

        Times (m,) give (m, 3), one time gives (3,); times outside are moved to the ends.
        """
        spans = len(self.points) - 3
        knots = np.clip(np.asarray(time_s, float) / self.span_s, 0, spans)
        first = np.minimum(knots.astype(int), spans - 1)
        share = (knots - first)[..., None]
        exponents = np.maximum(np.arange(4) - derivative, 0)
        powers = np.array(_FALLING[derivative]) * share**exponents
        weights = powers @ _BASIS / self.span_s**derivative
        return np.asarray(
            np.einsum("...i,...ij->...j", weights, self.points[first[..., None] + np.arange(4)])
        )

    def velocities(self) -> Array:
        """Control points (n - 1, 3) of the velocity; the curve stays in their hull."""
        return np.asarray(np.diff(self.points, axis=0) / self.span_s)

    def accelerations(self) -> Array:
        """Control points (n - 2, 3) of the acceleration."""
        return np.asarray(np.diff(self.points, n=2, axis=0) / self.span_s**2)


@lru_cache(maxsize=64)
def sampling_matrix(count: int, per_span: int) -> Array:
    """Matrix (m, count) from control points to ``per_span`` samples per span and the end."""
    spans = count - 3
    matrix = np.zeros((spans * per_span + 1, count))
    for row in range(len(matrix)):
        span = min(row // per_span, spans - 1)
        share = row / per_span - span
        matrix[row, span : span + 4] = share ** np.arange(4) @ _BASIS
    matrix.flags.writeable = False
    return matrix


def state_points(state: Array, span_s: float) -> Array:
    """Return the three control points (3, 3) at whose middle knot the curve has a state.

    ``state`` (3, 3) holds position, velocity and acceleration as rows.
    """
    position, velocity, acceleration = state
    bend = acceleration * span_s**2
    middle = position - bend / 6
    return np.stack(
        [middle + bend / 2 - velocity * span_s, middle, middle + bend / 2 + velocity * span_s]
    )


def fit(samples: Array, start: Array, end: Array, span_s: float) -> UniformSpline:
    """Return the spline through ``samples`` (k, 3), one per knot, least squares, k >= 5.

    It meets the states ``start`` and ``end`` (3, 3: position, velocity, acceleration)
    exactly; the first and the last sample are not used.
    """
    count = len(samples) + 2
    points = np.zeros((count, 3))
    points[:FIXED] = state_points(start, span_s)
    points[-FIXED:] = state_points(end, span_s)
    inner, inverse = _inner_fit(len(samples))
    if inverse.size:
        points[FIXED:-FIXED] = inverse @ (samples[1:-1] - inner @ points)
    return UniformSpline(points=points, span_s=span_s)


@lru_cache(maxsize=64)
def _inner_fit(samples: int) -> tuple[Array, Array]:
    """Matrices: all control points to the inner knots, and inner knots to free points."""
    matrix = sampling_matrix(samples + 2, 1)[1:-1]
    return matrix, np.asarray(np.linalg.pinv(matrix[:, FIXED:-FIXED]), np.float64)
