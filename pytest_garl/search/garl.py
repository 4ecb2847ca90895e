"""garl: the paper's search, pulled towards violations and away from known ones."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import farthest_from_nearest, local_steps, property_mutation


class Archive:
    """The archive of signatures, and the objectives that it bends."""

    def __init__(self) -> None:
        self._archive: Counter[str] = Counter()
        self._known: set[Scenario] = set()

    def objectives(self, chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
        """Threat and diversity, both maximised; shape (k, 2)."""
        for item in flown:
            if item.scenario not in self._known:
                self._known.add(item.scenario)
                self._archive[item.result["verdict"]["signature"]] += 1
        values = [self._threat(item.result) for item in flown]
        return np.column_stack([values, diversity(chromosomes)])

    def _threat(self, result: dict[str, Any]) -> float:
        signature = result["verdict"]["signature"]
        return threat(result) + (1.0 / self._archive[signature] if signature else 0.0)


def method(plan: Plan) -> Nsga2:
    """Return the search."""
    return Nsga2("garl", plan, Archive().objectives, 2, mutation)


def mutation(offspring: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """Step nearby in every second child, into the emptiest places in the others."""
    near = local_steps(offspring, lower, upper, rng)
    far = property_mutation(offspring, lower, upper, rng, choose=farthest_from_nearest)
    stays = rng.random(len(offspring)) < 0.5
    return np.where(stays[:, None], near, far)
