"""garl: the paper's search, pulled towards violations and spread over their kinds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import Flown, Plan
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import farthest_from_nearest, local_steps, property_mutation

VIOLATION = 2.0
"""What a violation is worth; the nearest miss is worth less than 1."""
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
    """Return threats (k,) in which scenarios that threaten alike share what that is worth.

    Alike are flights whose closest call was to the same kind of body in the same part of the
    landing.  The k-th of them counts 1/k of its threat, which is 2 for a violation: first
    come violations of signatures that no other has, then other violations, the most remote
    (``spread``) first, then near misses.  So the nearest miss of a kind that was never hit is
    worth more than the third hit of a kind that is known.
    """
    results = [item.result for item in flown]
    signatures = [result["verdict"]["signature"] for result in results]
    threats = np.array(
        [
            VIOLATION if signature else threat(result)
            for signature, result in zip(signatures, results, strict=True)
        ]
    )
    known: set[str] = set()
    repeats = np.zeros(len(results), dtype=bool)
    for index in np.argsort(-spread, kind="stable"):
        repeats[index] = signatures[index] in known
        known.add(signatures[index])
    places: Counter[str] = Counter()
    for index in np.lexsort((-spread, repeats, -threats)):
        alike = results[index]["closest_call"] or results[index]["outcome"]
        places[alike] += 1
        threats[index] /= places[alike]
    return threats


def mutation(offspring: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """Step nearby in every second child, into the emptiest places in the others."""
    near = local_steps(offspring, lower, upper, rng)
    far = property_mutation(offspring, lower, upper, rng, choose=farthest_from_nearest)
    stays = rng.random(len(offspring)) < 0.5
    return np.where(stays[:, None], near, far)
