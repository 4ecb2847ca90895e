from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.search.operators import (
    farthest_from_all,
    nuclear_gene_crossover,
    property_mutation,
)


def test_crossover_swaps_the_tails_of_adjacent_pairs() -> None:
    parents = np.array([[1.0, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]])
    children = nuclear_gene_crossover(parents, [2], np.random.default_rng(0), probability=1.0)
    assert children.tolist() == [[1, 2, 7, 8], [5, 6, 3, 4], [9, 10, 11, 12]]


def test_crossover_copies_parents_at_probability_zero() -> None:
    parents = np.arange(8.0).reshape(2, 4)
    children = nuclear_gene_crossover(parents, [1, 2, 3], np.random.default_rng(0), probability=0.0)
    assert (children == parents).all()


@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(2, 9))
def test_crossover_cuts_only_at_nuclear_gene_borders(seed: int, rows: int) -> None:
    # Columns 0 | 1 2 | 3 4 5 are three nuclear genes; a gene stays whole if its columns agree.
    parents = np.repeat(np.arange(rows, dtype=np.float64)[:, None], 6, axis=1)
    children = nuclear_gene_crossover(parents, [1, 3], np.random.default_rng(seed), probability=1.0)
    assert (children[:, 1] == children[:, 2]).all()
    assert (children[:, 3] == children[:, 4]).all()
    assert (children[:, 4] == children[:, 5]).all()
    assert sorted(children[:, 5]) == sorted(parents[:, 5])


def test_crossover_happens_at_the_stated_rate() -> None:
    parents = np.arange(4000.0).reshape(2000, 2)
    children = nuclear_gene_crossover(parents, [1], np.random.default_rng(1), probability=0.2)
    rate = (children[::2] != parents[::2]).any(axis=1).mean()
    assert rate == pytest.approx(0.2, abs=0.03)


def test_paper_candidate_rule_takes_the_largest_sum_of_distances() -> None:
    # Sums to {0, 0.2, 1}: 0.5 -> 1.3; 0.9 -> 1.7; 0.1 -> 1.1.
    assert farthest_from_all(np.array([0.5, 0.9, 0.1]), np.array([0.0, 0.2, 1.0])) == 1


def test_mutation_keeps_every_property_in_its_range() -> None:
    lower, upper = np.array([-1.0, 0.0]), np.array([1.0, 0.15])
    generation = np.zeros((50, 2))
    mutated = property_mutation(generation, lower, upper, np.random.default_rng(2), probability=1.0)
    assert (mutated >= lower).all()
    assert (mutated <= upper).all()
    assert (mutated != generation).all()


def test_mutation_compares_with_rows_that_have_mutated_already() -> None:
    generation = np.zeros((2, 1))
    lower, upper = np.array([0.0]), np.array([1.0])
    mutated = property_mutation(
        generation, lower, upper, np.random.default_rng(3), probability=1.0, candidates=200
    )
    # The first goes far from {0, 0}; the second's rule then weighs 0 and the first's new value.
    assert mutated[0, 0] > 0.95
    sums = np.abs(mutated[1, 0] - np.array([mutated[0, 0], 0.0])).sum()
    assert sums >= mutated[0, 0]


def test_mutation_happens_at_the_stated_rate() -> None:
    generation = np.full((300, 10), 0.5)
    mutated = property_mutation(
        generation, np.zeros(10), np.ones(10), np.random.default_rng(4), probability=0.2
    )
    assert (mutated != generation).mean() == pytest.approx(0.2, abs=0.03)
