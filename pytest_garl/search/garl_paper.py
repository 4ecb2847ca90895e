"""garl-paper: the paper's Algorithm 1, with its three objectives and its operators."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity
from pytest_garl.search.operators import property_mutation


def method(plan: Plan) -> Nsga2:
    """Return the search; populations of 20 and rates of 0.2 as in the paper."""
    return Nsga2("garl-paper", plan, objectives, 3, property_mutation)


def objectives(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Distance to landing, time to landing and diversity, all maximised; shape (k, 3)."""
    distance = [item.result["final_distance_m"] for item in flown]
    elapsed = [item.result["elapsed_s"] for item in flown]
    return np.column_stack([distance, elapsed, diversity(chromosomes)])
