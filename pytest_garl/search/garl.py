"""garl: the paper's search, pulled towards violations and spread over their kinds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import farthest_from_nearest, local_steps, property_mutation

FIRST_OF_ITS_KIND = 2.0


def method(plan: Plan) -> Nsga2:
    """Return the search."""
    return Nsga2("garl", plan, objectives, 2, mutation)


def objectives(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Shared threat and diversity, both maximised; shape (k, 2)."""
    spread = diversity(chromosomes)
    return np.column_stack([shared_threat(flown, spread), spread])


def shared_threat(flown: Sequence[Flown], spread: Matrix) -> Matrix:
    """Return threats (k,) in which scenarios that violate alike share what that is worth.

    The k-th violation of a signature counts 2/k, the most remote (``spread``) being the
    first: a second kind is worth more than one more of the first, and from the third on a
    violation of a known kind is worth less than a near miss.
    """
    threats = np.array([threat(item.result) for item in flown])
    kinds: Counter[str] = Counter()
    for index in np.argsort(-spread, kind="stable"):
        signature = flown[index].result["verdict"]["signature"]
        if signature:
            kinds[signature] += 1
            threats[index] = FIRST_OF_ITS_KIND / kinds[signature]
    return threats


def mutation(offspring: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """Step nearby in every second child, into the emptiest places in the others."""
    near = local_steps(offspring, lower, upper, rng)
    far = property_mutation(offspring, lower, upper, rng, choose=farthest_from_nearest)
    stays = rng.random(len(offspring)) < 0.5
    return np.where(stays[:, None], near, far)
