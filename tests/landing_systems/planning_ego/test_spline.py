from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import BSpline

from landing_systems.modules.planning_ego import EgoParameters, costs
from landing_systems.modules.planning_ego.bspline import (
    UniformSpline,
    fit,
    sampling_matrix,
    state_points,
)
from landing_systems.modules.planning_ego.guides import Pairs
from landing_systems.modules.planning_ego.initial import initial_spline

POINTS = np.random.default_rng(7).uniform(-4, 4, (11, 3))
PARAMETERS = EgoParameters(max_vertical_vel_mps=1.0)


def test_it_is_the_curve_that_scipy_draws() -> None:
    spline = UniformSpline(points=POINTS, span_s=0.3)
    reference = BSpline((np.arange(len(POINTS) + 4) - 3) * 0.3, POINTS, 3)
    times = np.linspace(0, spline.duration_s, 57)
    for order in range(3):
        found = spline.evaluate(times[:-1], order)
        assert np.allclose(found, reference(times[:-1], nu=order))
    assert np.allclose(spline.evaluate(spline.duration_s), reference(times[-1]))
    assert np.allclose(spline.evaluate(99.0), spline.evaluate(spline.duration_s))


def test_samples_by_matrix_are_those_by_time() -> None:
    spline = UniformSpline(points=POINTS, span_s=0.3)
    times = np.linspace(0, spline.duration_s, 8 * 4 + 1)
    assert np.allclose(sampling_matrix(11, 4) @ POINTS, spline.evaluate(times))


def test_derivatives_stay_in_the_hull_of_their_control_points() -> None:
    spline = UniformSpline(points=POINTS, span_s=0.3)
    times = np.linspace(0, spline.duration_s, 200)
    for order, hull in ((1, spline.velocities()), (2, spline.accelerations())):
        values = spline.evaluate(times, order)
        assert (values <= hull.max(axis=0) + 1e-9).all()
        assert (values >= hull.min(axis=0) - 1e-9).all()


def test_a_fit_meets_both_states_and_passes_the_samples() -> None:
    start = np.array([[0, 0, 5], [1.0, -0.5, 0.2], [0.3, 0.1, -0.4]])
    end = np.array([[4, 2, 3], [0.5, 0.5, -1.0], [0.0, 0.2, 0.0]])
    steps = np.linspace(0, 1, 12)[:, None]
    samples = start[0] + steps * (end[0] - start[0])
    spline = fit(samples, start, end, 0.25)
    for order in range(3):
        assert np.allclose(spline.evaluate(0.0, order), start[order])
        assert np.allclose(spline.evaluate(spline.duration_s, order), end[order])
    assert np.abs(spline.evaluate(0.25 * np.arange(2, 10)) - samples[2:10]).max() < 0.1


def test_state_points_of_rest_are_the_place() -> None:
    state = np.array([[1.0, 2.0, 3.0], [0, 0, 0], [0, 0, 0]])
    assert np.allclose(state_points(state, 0.2), state[[0, 0, 0]])


@pytest.mark.parametrize("length", [0.0, 0.05, 1.0, 7.0])
def test_an_initial_spline_joins_its_states_however_short_the_way(length: float) -> None:
    start = np.array([[0, 0, 5], [0.4, 0, 0], [0, 0, 0.0]])
    end = np.array([[length, 0, 5], [0, 0, 0], [0, 0, 0.0]])
    spline = initial_spline(np.stack([start[0], end[0]]), start, end, PARAMETERS)
    assert np.isfinite(spline.points).all()
    assert np.allclose(spline.evaluate(0.0, 1), start[1])
    assert np.allclose(spline.evaluate(spline.duration_s), end[0])


def test_an_initial_spline_keeps_the_speed_limit_on_a_straight_way() -> None:
    start, end = np.zeros((3, 3)), np.zeros((3, 3))
    end[0] = (7.0, 0.0, 0.0)
    spline = initial_spline(np.stack([start[0], end[0]]), start, end, PARAMETERS)
    speeds = np.linalg.norm(spline.velocities(), axis=1)
    assert 1.5 < speeds.max() < 2.1


def gradient_error(
    term: costs.Term, cost: Callable[[np.ndarray], costs.Term], points: np.ndarray
) -> float:
    """Largest difference of a gradient from central differences, relative to its largest."""
    numeric = np.zeros_like(points)
    for index in np.ndindex(points.shape):
        step = np.zeros_like(points)
        step[index] = 1e-5
        numeric[index] = (cost(points + step)[0] - cost(points - step)[0]) / 2e-5
    return float(np.abs(term[1] - numeric).max() / np.abs(numeric).max())


def test_gradient_of_smoothness() -> None:
    term = costs.smoothness(POINTS)
    assert term[0] == pytest.approx((np.diff(POINTS, n=3, axis=0) ** 2).sum())
    assert gradient_error(term, costs.smoothness, POINTS) < 1e-6


def test_gradient_of_collision() -> None:
    rng = np.random.default_rng(3)
    index = rng.integers(0, len(POINTS), 12)
    direction = rng.normal(size=(12, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    # Missing clearances on all three branches of the penalty.
    base = POINTS[index] + rng.uniform(-1.0, 1.5, 12)[:, None] * direction
    pairs = Pairs(index=index, base=base, direction=direction)
    missing = 0.5 - pairs.distances(POINTS)
    assert (missing < 0).any()
    assert ((missing > 0) & (missing < 0.5)).any()
    assert (missing > 0.5).any()

    def cost(points: np.ndarray) -> costs.Term:
        return costs.collision(points, pairs, 0.5)

    assert gradient_error(cost(POINTS), cost, POINTS) < 1e-6


@pytest.mark.parametrize(
    ("distance", "expected"),
    # c = 0.5 - distance; c³ up to the clearance, then 3 s c² - 3 s² c + s³ with s = 0.5.
    [(0.6, 0.0), (0.3, 0.2**3), (0.0, 0.5**3), (-0.5, 1.5 - 0.75 + 0.125)],
)
def test_the_penalty_is_that_of_the_paper(distance: float, expected: float) -> None:
    pairs = Pairs(index=np.array([2]), base=np.zeros((1, 3)), direction=np.array([[0.0, 1.0, 0.0]]))
    points = np.zeros((7, 3))
    points[2, 1] = distance
    assert costs.collision(points, pairs, 0.5)[0] == pytest.approx(expected)


@pytest.mark.parametrize("span", [0.4, 1.0, 2.0])
def test_gradient_of_feasibility(span: float) -> None:
    def cost(points: np.ndarray) -> costs.Term:
        return costs.feasibility(points, span, PARAMETERS)

    assert cost(POINTS)[0] > 0
    assert gradient_error(cost(POINTS), cost, POINTS) < 1e-6


def test_a_slow_trajectory_costs_nothing() -> None:
    cost, gradient = costs.feasibility(POINTS, 50.0, PARAMETERS)
    assert cost == 0
    assert not gradient.any()


def test_gradient_of_fitness() -> None:
    reference = np.cumsum(np.random.default_rng(1).uniform(0.1, 1, (9, 3)), axis=0)

    def cost(points: np.ndarray) -> costs.Term:
        return costs.fitness(points, reference, PARAMETERS)

    assert gradient_error(cost(POINTS), cost, POINTS) < 1e-6


def test_leaving_a_path_sideways_costs_25_times_as_much_as_being_late() -> None:
    line = np.zeros((11, 3))
    line[:, 0] = np.arange(11.0)
    reference = sampling_matrix(11, 1) @ line
    late, aside = line - (0.3, 0, 0), line - (0, 0.3, 0)
    cost = costs.fitness(aside, reference, PARAMETERS)[0]
    assert cost == pytest.approx(9 * 0.3**2)
    assert costs.fitness(late, reference, PARAMETERS)[0] == pytest.approx(cost / 25)
