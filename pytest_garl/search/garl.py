"""garl: the paper's search, pulled towards violations and spread over their kinds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import farthest_from_nearest, local_steps, property_mutation

IMMIGRANTS = 0.25
"""Share of each generation that is drawn at random (Grefenstette 1992), so that kinds of failure
that no survivor resembles can still be found."""


def method(plan: Plan) -> Nsga2:
    """Return the search."""
    return Nsga2("garl", plan, objectives, 2, mutation, immigrants=IMMIGRANTS)


def objectives(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Shared threat and diversity, both maximised; shape (k, 2)."""
    spread = diversity(chromosomes)
    return np.column_stack([shared_threat(flown, spread), spread])


def shared_threat(flown: Sequence[Flown], spread: Matrix) -> Matrix:
    """Return threats (k,) in which violations of one signature share what that is worth.

    The k-th counts 1 + 1/k, the most remote (``spread``) being the first: the only one of
    its kind is worth more than one more of a kind that the generation has, and any violation
    is worth more than a near miss.
    """
    threats = np.array([threat(item.result) for item in flown])
    places: Counter[str] = Counter()
    for index in np.argsort(-spread, kind="stable"):
        signature = flown[index].result["verdict"]["signature"]
        if signature:
            places[signature] += 1
            threats[index] = 1 + 1 / places[signature]
    return threats


def mutation(offspring: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """Step nearby in every second child, into the emptiest places in the others."""
    near = local_steps(offspring, lower, upper, rng)
    far = property_mutation(offspring, lower, upper, rng, choose=farthest_from_nearest)
    stays = rng.random(len(offspring)) < 0.5
    return np.where(stays[:, None], near, far)
