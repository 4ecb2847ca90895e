"""L-BFGS with a Hessian to start from: a few lines, for SciPy's overhead is half the budget."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SUFFICIENT_DECREASE = 1e-4
"""Armijo's constant, the customary one (Nocedal and Wright 2006, section 3.1)."""
MAX_HALVINGS = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Minimum:
    """Result of a minimisation: the variables, and the number of iterations."""

    x: Array
    iterations: int


def minimise(
    cost: Callable[[Array], tuple[float, Array]],
    x: Array,
    inverse_hessian: Array,
    *,
    memory: int,
    max_iterations: int,
    gradient_tolerance: float,
    relative_tolerance: float,
    stop: Callable[[Array], bool] | None = None,
) -> Minimum:
    """Minimise ``cost``, which gives value and gradient, over ``x`` (n, k), from ``x`` on.

    ``inverse_hessian`` (n, n), positive definite, is the first guess for each column: the
    two-loop recursion (Nocedal 1980) improves on it.  Ends when the gradient's largest
    component or the relative decrease of the cost is small, no step decreases the cost,
    or ``stop``, asked after each iteration, says so.
    """
    value, gradient = cost(x)
    steps: list[tuple[Array, Array, float]] = []
    iterations = 0
    while iterations < max_iterations and np.abs(gradient).max() > gradient_tolerance:
        direction = _direction(gradient, steps, inverse_hessian)
        slope = float(np.vdot(direction, gradient))
        if slope >= 0:
            steps.clear()
            direction = -(inverse_hessian @ gradient)
            slope = float(np.vdot(direction, gradient))
        length = 1.0
        for _ in range(MAX_HALVINGS):
            trial = x + length * direction
            trial_value, trial_gradient = cost(trial)
            if trial_value <= value + SUFFICIENT_DECREASE * length * slope:
                break
            length /= 2
        else:
            break
        iterations += 1
        change, bend = trial - x, trial_gradient - gradient
        curvature = float(np.vdot(change, bend))
        # Without curvature along the step, the memory would no longer be positive definite.
        if curvature > 1e-10 * float(np.vdot(bend, bend)):
            steps.append((change, bend, 1 / curvature))
            del steps[:-memory]
        small = value - trial_value <= relative_tolerance * max(abs(value), 1e-6)
        x, value, gradient = trial, trial_value, trial_gradient
        if (stop is not None and stop(x)) or small:
            break
    return Minimum(x=x, iterations=iterations)


def _direction(
    gradient: Array, steps: list[tuple[Array, Array, float]], inverse_hessian: Array
) -> Array:
    """Return the quasi-Newton direction by the two-loop recursion."""
    rest = gradient.copy()
    shares = []
    for change, bend, inverse in reversed(steps):
        share = inverse * float(np.vdot(change, rest))
        shares.append(share)
        rest -= share * bend
    result = inverse_hessian @ rest
    if steps:
        change, bend, inverse = steps[-1]
        result *= 1 / (inverse * float(np.vdot(bend, inverse_hessian @ bend)))
    for (change, bend, inverse), share in zip(steps, reversed(shares), strict=True):
        result += (share - inverse * float(np.vdot(bend, result))) * change
    return -result
