from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.search.objectives import diversity


def test_diversity_is_the_mean_distance_to_all_members() -> None:
    # Distances: 0-1 is 5, 0-2 is 0, 1-2 is 5; each sum is divided by all three members.
    generation = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 0.0]])
    assert diversity(generation) == pytest.approx([5 / 3, 10 / 3, 5 / 3])


def test_diversity_of_equal_chromosomes_is_zero() -> None:
    assert diversity(np.full((4, 3), 0.2)).tolist() == [0, 0, 0, 0]
