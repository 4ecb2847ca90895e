from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.stats import binom

from pytest_garl.search.objectives import diversity
from pytest_garl.verdicts.metrics import (
    decided,
    decided_words,
    mean_distance,
    no_cells,
    share_interval,
    top_k,
    visit,
)
from pytest_garl.verdicts.verdict import Margin, Verdict

BOUNDS_M = (-10.0, 10.0, -20.0, 20.0)


def verdict(violation: bool) -> Verdict:
    return Verdict(
        outcome="landed",
        primary=None,
        violation_type=None,
        signature="",
        paper_violation=violation,
        margins=(),
        story="",
    )


@pytest.mark.parametrize(("count", "total"), [(0, 40), (7, 40), (40, 40)])
def test_at_either_end_of_the_interval_the_count_is_just_likely(count: int, total: int) -> None:
    low, high = share_interval(count, total)
    assert low <= count / total <= high
    if count:
        assert binom.sf(count - 1, total, low) == pytest.approx(0.025)
    if count < total:
        assert binom.cdf(count, total, high) == pytest.approx(0.025)


def test_nothing_flown_tells_nothing() -> None:
    assert share_interval(0, 0) == (0.0, 1.0)


def test_top_k_counts_flights() -> None:
    verdicts = [verdict(bad) for bad in (False, True, False, True, True)]
    assert top_k(verdicts, 1) == 2
    assert top_k(verdicts, 3) == 5
    assert top_k(verdicts, 4) is None


def test_the_distance_is_the_mean_over_all_ordered_pairs() -> None:
    # Distances 3, 4 and 5, each twice among nine pairs.
    triangle = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    assert mean_distance(triangle) == pytest.approx(2 * (3 + 4 + 5) / 9)
    assert mean_distance(triangle[:1]) == 0.0
    assert mean_distance(np.empty((0, 2))) == 0.0


@settings(deadline=None)
@given(arrays(float, st.tuples(st.integers(1, 12), st.integers(1, 5)), elements=st.floats(0, 1)))
def test_the_distance_is_the_mean_of_the_papers_diversity(
    scenarios: NDArray[np.float64],
) -> None:
    assert mean_distance(scenarios) == pytest.approx(diversity(scenarios).mean(), abs=1e-9)


def test_uniform_weather_of_five_genes_is_as_far_apart_as_the_papers_random() -> None:
    weather = np.random.default_rng(0).uniform(0, 0.15, (400, 5))
    assert mean_distance(weather) == pytest.approx(0.131, abs=0.003)


def test_a_track_covers_the_cells_it_passes() -> None:
    cells = no_cells(BOUNDS_M)
    assert cells.shape == (10, 20, 15)
    # Up through three cells, then across the border to the east, then back where it was.
    track = np.array([[0.1, 0.1, z] for z in (0.0, 1.9, 2.1, 4.5)] + [[2.1, 0.1, 4.5]] * 2)
    visit(cells, track, BOUNDS_M)
    assert {tuple(int(n) for n in cell) for cell in np.argwhere(cells)} == {
        (5, 10, 0),
        (5, 10, 1),
        (5, 10, 2),
        (6, 10, 2),
    }
    visit(cells, track, BOUNDS_M)
    assert cells.sum() == 4


def test_what_lies_outside_covers_nothing() -> None:
    cells = no_cells(BOUNDS_M)
    visit(
        cells,
        np.array([[-10.1, 0, 1], [10.0, 0, 1], [0, 20.0, 1], [0, 0, 30.0], [0, 0, -0.1]]),
        BOUNDS_M,
    )
    assert not cells.any()


@given(st.floats(1, 50), st.floats(1, 50))
def test_a_cell_that_sticks_out_counts(width: float, depth: float) -> None:
    shape = no_cells((0.0, width, 0.0, depth)).shape
    assert shape == (math.ceil(width / 2), math.ceil(depth / 2), 15)


def test_what_flights_decided_is_counted_by_property() -> None:
    def flown(distance: bool, time: bool) -> Verdict:
        margins = (
            Margin(property="distance", value=1.0, unit="m", decided=distance),
            Margin(property="time", value=1.0, unit="s", decided=time),
        )
        return dataclasses.replace(verdict(False), margins=margins)

    # A flight whose process died has no margins at all.
    flights = [flown(True, True), flown(False, True), flown(False, False), verdict(False)]
    assert (decided(flights, "distance"), decided(flights, "time")) == (1, 2)
    assert decided_words(flights) == "distance decided in 1 of 4 flights, time in 2"
