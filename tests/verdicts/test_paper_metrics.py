from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from pytest_garl.search.objectives import diversity
from pytest_garl.verdicts.paper_metrics import empty_cells, mark_visited, mean_distance, top_k
from tests.verdicts.test_verdict import verdict

BOUNDS_M = (-10.0, 10.0, -20.0, 20.0)


def test_top_k_counts_flights_up_to_the_kth_violation() -> None:
    verdicts = [verdict(bad) for bad in (False, True, False, True, True)]
    assert top_k(verdicts, 1) == 2
    assert top_k(verdicts, 3) == 5
    assert top_k(verdicts, 4) is None


def test_parameter_distance_is_the_mean_over_all_ordered_pairs() -> None:
    # Distances 3, 4 and 5, each twice among nine pairs.
    triangle = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    assert mean_distance(triangle) == pytest.approx(2 * (3 + 4 + 5) / 9)
    assert mean_distance(triangle[:1]) == 0.0
    assert mean_distance(np.empty((0, 2))) == 0.0


@given(arrays(float, st.tuples(st.integers(1, 12), st.integers(1, 5)), elements=st.floats(0, 1)))
def test_parameter_distance_is_the_mean_of_the_diversity_objective(
    scenarios: NDArray[np.float64],
) -> None:
    assert mean_distance(scenarios) == pytest.approx(diversity(scenarios).mean(), abs=1e-9)


def test_uniform_weather_of_five_genes_has_the_papers_distance_of_random_search() -> None:
    weather = np.random.default_rng(0).uniform(0, 0.15, (400, 5))
    assert mean_distance(weather) == pytest.approx(0.131, abs=0.003)


def test_a_track_marks_the_cells_that_it_passes() -> None:
    cells = empty_cells(BOUNDS_M)
    assert cells.shape == (10, 20, 15)
    # Up through three cells, then across the border to the east, then back where it was.
    track = np.array([[0.1, 0.1, z] for z in (0.0, 1.9, 2.1, 4.5)] + [[2.1, 0.1, 4.5]] * 2)
    mark_visited(cells, track, BOUNDS_M)
    assert {tuple(int(n) for n in cell) for cell in np.argwhere(cells)} == {
        (5, 10, 0),
        (5, 10, 1),
        (5, 10, 2),
        (6, 10, 2),
    }
    mark_visited(cells, track, BOUNDS_M)
    assert cells.sum() == 4


def test_positions_outside_of_the_volume_mark_no_cell() -> None:
    cells = empty_cells(BOUNDS_M)
    mark_visited(
        cells,
        np.array([[-10.1, 0, 1], [10.0, 0, 1], [0, 20.0, 1], [0, 0, 30.0], [0, 0, -0.1]]),
        BOUNDS_M,
    )
    assert not cells.any()


@given(st.floats(1, 50), st.floats(1, 50))
def test_a_cell_partly_outside_of_the_map_counts(width: float, depth: float) -> None:
    shape = empty_cells((0.0, width, 0.0, depth)).shape
    assert shape == (math.ceil(width / 2), math.ceil(depth / 2), 15)
