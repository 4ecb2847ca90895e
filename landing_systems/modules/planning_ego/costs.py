"""The terms of the trajectory's cost, each with its gradient with respect to control points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.bspline import sampling_matrix
from landing_systems.modules.planning_ego.guides import Pairs
from landing_systems.modules.planning_ego.parameters import EgoParameters

Array = NDArray[np.float64]
Term = tuple[float, Array]


def smoothness(points: Array) -> Term:
    """Sum of the squared third differences of control points (n, 3): jerk without its time."""
    slope = third_differences(len(points)) @ points
    return float(np.vdot(slope, points)), 2 * slope


def collision(points: Array, pairs: Pairs, clearance_m: float) -> Term:
    """Penalty for each pair whose control point is less than the clearance from the obstacle.

    With c the missing clearance and s the clearance wanted: 0 for c <= 0, c³ for
    c <= s, else 3 s c² - 3 s² c + s³, which is smooth and grows with the square.
    """
    gradient = np.zeros_like(points)
    missing = clearance_m - pairs.distances(points)
    short = missing > 0
    if not short.any():
        return 0.0, gradient
    c, s = missing[short], clearance_m
    near = c <= s
    cost = np.where(near, c**3, 3 * s * c**2 - 3 * s**2 * c + s**3)
    slope = np.where(near, 3 * c**2, 6 * s * c - 3 * s**2)
    np.add.at(gradient, pairs.index[short], -slope[:, None] * pairs.direction[short])
    return float(cost.sum()), gradient


def feasibility(points: Array, span_s: float, parameters: EgoParameters) -> Term:
    """Squares of what speed, over the knot span, and acceleration exceed their limits by.

    Speed and acceleration are lengths of vectors (upstream: each axis on its own); the
    vertical speed is stretched so that its own limit becomes the common one.
    """
    p = parameters
    stretch = speed_scale(p)
    first = points[1:] - points[:-1]
    speed_cost, speed_gradient = _excess(first / span_s * stretch, p.max_vel_mps)
    bend = first[1:] - first[:-1]
    bend_cost, bend_gradient = _excess(bend / span_s**2, p.max_acc_mps2)
    gradient = np.zeros_like(points)
    if speed_cost > 0:
        part = speed_gradient * (stretch / span_s**3)
        gradient[1:] += part
        gradient[:-1] -= part
    if bend_cost > 0:
        part = bend_gradient / span_s**2
        gradient[2:] += part
        gradient[1:-1] -= 2 * part
        gradient[:-2] += part
    return speed_cost / span_s**2 + bend_cost, gradient


def fitness(points: Array, reference: Array, parameters: EgoParameters) -> Term:
    """How far the curve's knots leave a reference curve's (n - 2, 3), along it and sideways.

    An ellipse about each reference knot: (x . t)² / axial + |x × t|² / radial with the
    offset x and the reference's unit tangent t.
    """
    matrix = sampling_matrix(len(points), 1)
    tangents = np.gradient(reference, axis=0)
    lengths = np.linalg.norm(tangents, axis=1, keepdims=True)
    tangents = tangents / np.maximum(lengths, 1e-9)
    offsets = matrix @ points - reference
    along = np.einsum("ij,ij->i", offsets, tangents)[:, None] * tangents
    aside = offsets - along
    pull = along / parameters.fitness_axial + aside / parameters.fitness_radial
    return float(np.vdot(offsets, pull)), matrix.T @ (2 * pull)


def usage(points: Array, span_s: float, parameters: EgoParameters) -> tuple[float, float]:
    """Return the largest speed and acceleration as shares of their limits.

    What the start's state alone determines is left out: no timing changes it.
    """
    p = parameters
    first = np.diff(points, axis=0)
    speed = np.linalg.norm(first[2:] / span_s * speed_scale(p), axis=1).max()
    bend = np.linalg.norm(np.diff(first, axis=0)[1:] / span_s**2, axis=1).max()
    return float(speed / p.max_vel_mps), float(bend / p.max_acc_mps2)


def speed_scale(parameters: EgoParameters) -> Array:
    """Factors (3,) that make the limits of all directions equal to ``max_vel_mps``."""
    return np.array([1.0, 1.0, parameters.max_vel_mps / parameters.vertical_vel_mps])


def _excess(vectors: Array, limit: float) -> Term:
    """Squares of what vectors are longer than a limit, and the gradient by the vectors."""
    squares = np.einsum("ij,ij->i", vectors, vectors)
    if squares.max() <= limit**2:
        return 0.0, vectors
    lengths = np.sqrt(squares)
    over = np.maximum(lengths - limit, 0.0)
    return float(over @ over), (2 * over / np.maximum(lengths, limit))[:, None] * vectors


@lru_cache(maxsize=64)
def third_differences(count: int) -> Array:
    """Matrix (n, n) of the quadratic form of the squared third differences."""
    difference = np.diff(np.eye(count), n=3, axis=0)
    return np.asarray(difference.T @ difference)
