"""The optimisation: push the spline out of obstacles, then give it the time that it needs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego import costs
from landing_systems.modules.planning_ego.bspline import FIXED, UniformSpline, fit, sampling_matrix
from landing_systems.modules.planning_ego.guides import CollisionSearch, Pairs
from landing_systems.modules.planning_ego.lbfgs import minimise
from landing_systems.modules.planning_ego.parameters import EgoParameters

Array = NDArray[np.float64]
RELATIVE_TOLERANCE = 1e-3
"""A step that lowers the cost by a smaller share ends the minimisation: control points are
within millimetres by then."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Task:
    """One trajectory to make: its initial spline, the states (3, 3) that it joins, its bounds."""

    initial: UniformSpline
    start: Array
    end: Array
    search: CollisionSearch
    lowest_m: float


def optimise(task: Task, parameters: EgoParameters) -> UniformSpline | None:
    """Return a spline that collides nowhere where it is checked, or None.

    Raises GoalInObstacleError if the spline's end is within an obstacle.
    """
    pushed = _push_out(task, parameters)
    return None if pushed is None else _reallocate_time(pushed, task, parameters)


def _push_out(task: Task, parameters: EgoParameters) -> UniformSpline | None:
    """Minimise smoothness, collision and feasibility, meeting obstacles on the way."""
    p, search, span = parameters, task.search, task.initial.span_s
    points = task.initial.points
    pairs = search.pairs(points)
    if pairs is None:
        return None
    weight = p.weight_collision
    solver = _Solver(task, p)
    for _ in range(p.max_restarts + 1):
        for _ in range(p.max_rebounds + 1):
            rebound = _Rebound(search, pairs, p)
            objective = _Objective(p, span, pairs=pairs, collision_weight=weight)
            points = solver.minimise(objective, points, rebound.look)
            if not len(rebound.fresh):
                break
            more = search.pairs(points, rebound.fresh)
            if more is None:
                return None
            pairs = pairs.and_also(more)
        if search.is_free(points):
            return UniformSpline(points=points, span_s=span)
        more = search.pairs(points, rebound.unaware(points))
        if more is None or solver.iterations_left <= 0:
            return None
        pairs = pairs.and_also(more)
        weight *= 2
    return None


def _reallocate_time(spline: UniformSpline, task: Task, parameters: EgoParameters) -> UniformSpline:
    """Slow down until the limits are kept, staying on the curve by the fitness term.

    What is too fast in the end, for it starts too fast or the slower curve would collide
    whatever its fitness weighs, is flown all the same, as upstream.
    """
    p = parameters
    weight = p.weight_fitness
    solver = _Solver(task, p)
    for _ in range(p.max_reallocations):
        speed, acceleration = costs.usage(spline.points, spline.span_s, p)
        if max(speed, acceleration) <= 1 + p.feasibility_tolerance:
            return spline
        # Speeds fall with the time, accelerations with its square.
        span = spline.span_s * min(max(speed, math.sqrt(acceleration)), p.time_ratio_limit)
        reference = sampling_matrix(len(spline.points), 1) @ spline.points
        slower = fit(reference, task.start, task.end, span)
        objective = _Objective(p, span, reference=reference, fitness_weight=weight)
        points = solver.minimise(objective, slower.points)
        if task.search.is_free(points):
            spline = UniformSpline(points=points, span_s=span)
        else:
            weight *= 2
    return spline


class _Objective:
    """The weighted cost of all control points (n, 3) and its gradient."""

    def __init__(
        self,
        parameters: EgoParameters,
        span_s: float,
        *,
        pairs: Pairs | None = None,
        collision_weight: float = 0.0,
        reference: Array | None = None,
        fitness_weight: float = 0.0,
    ) -> None:
        self._p, self._span_s = parameters, span_s
        self._pairs, self._collision_weight = pairs, collision_weight
        self._reference, self._fitness_weight = reference, fitness_weight

    def __call__(self, points: Array) -> tuple[float, Array]:
        p = self._p
        terms = [
            (p.weight_smoothness, costs.smoothness(points)),
            (p.weight_feasibility, costs.feasibility(points, self._span_s, p)),
        ]
        if self._pairs is not None and len(self._pairs.index):
            penalty = costs.collision(points, self._pairs, p.clearance_m)
            terms.append((self._collision_weight, penalty))
        if self._reference is not None:
            leaving = costs.fitness(points, self._reference, p)
            terms.append((self._fitness_weight, leaving))
        weight, (value, slope) = terms[0]
        cost, gradient = weight * value, weight * slope
        for weight, (value, slope) in terms[1:]:
            cost += weight * value
            gradient += weight * slope
        return cost, gradient


class _Rebound:
    """Watches a minimisation: ends it when the curve has run into an obstacle not yet known."""

    def __init__(self, search: CollisionSearch, pairs: Pairs, parameters: EgoParameters) -> None:
        self._search, self._pairs, self._p = search, pairs, parameters
        self._iterations = 0
        self.fresh = np.zeros(0, np.intp)

    def look(self, points: Array) -> bool:
        """Whether to stop at control points (n, 3) after one more iteration."""
        self._iterations += 1
        if self._iterations > self._p.min_rebound_iterations:
            self.fresh = self.unaware(points)
        return len(self.fresh) > 0

    def unaware(self, points: Array) -> NDArray[np.intp]:
        """Return the colliding control points that are clear of all obstacles they know of."""
        colliding = self._search.colliding(points)
        if colliding.any():
            near = self._pairs.distances(points) <= self._p.clearance_m
            colliding[self._pairs.index[near]] = False
        return np.flatnonzero(colliding)


class _Solver:
    """Minimises over the movable control points; limits the iterations of all its calls."""

    def __init__(self, task: Task, parameters: EgoParameters) -> None:
        self._p = parameters
        self._lowest_m = task.lowest_m
        self.iterations_left = parameters.max_iterations

    def minimise(
        self,
        objective: _Objective,
        points: Array,
        stop: Callable[[Array], bool] | None = None,
    ) -> Array:
        """Return all control points (n, 3) at the minimum, or where ``stop`` said so."""
        p = self._p
        if len(points) <= 2 * FIXED:
            return points
        whole = points.copy()

        def cost(free: Array) -> tuple[float, Array]:
            whole[FIXED:-FIXED] = free
            value, gradient = objective(whole)
            return value, gradient[FIXED:-FIXED]

        def stopping(free: Array) -> bool:
            whole[FIXED:-FIXED] = free
            return stop is not None and stop(whole)

        found = minimise(
            cost,
            points[FIXED:-FIXED],
            _inverse_hessian(len(points), p.weight_smoothness, p.weight_collision * p.clearance_m),
            memory=p.memory,
            max_iterations=self.iterations_left,
            gradient_tolerance=p.gradient_tolerance,
            relative_tolerance=RELATIVE_TOLERANCE,
            stop=stopping,
        )
        self.iterations_left -= found.iterations
        whole[FIXED:-FIXED] = found.x
        # The curve is in the hull of its control points: it goes no lower than they do.
        np.maximum(whole[:, 2], self._lowest_m, out=whole[:, 2])
        return whole


@lru_cache(maxsize=64)
def _inverse_hessian(count: int, smoothness: float, penalty: float) -> Array:
    """Inverse (n - 6, n - 6) of the smoothness' Hessian, with a typical penalty's on top."""
    hessian = 2 * smoothness * costs.third_differences(count)
    free = hessian[FIXED:-FIXED, FIXED:-FIXED]
    return np.asarray(np.linalg.inv(free + penalty * np.eye(len(free))))
