"""garl-paper: the paper's Algorithm 1, with its three objectives and its operators.

GARL as published, the baseline of ``garl``: NSGA-II over distance to landing, time to landing and
diversity, with NPCs that the policy ``dqn-paper`` moves.

Choices, if paper and code differ or say nothing:

- The code measures diversity by the weather alone, not normalised.  This method follows the paper:
  the whole chromosome, normalised so that no property outweighs the others.
- The code mutates a property to the candidate farthest from the middle of the known violations.
  This method follows the paper: farthest from all values of the generation.  That needs no
  known violation.
- The code mutates rain twice and snow never, crosses the marker with itself, and swaps halves of
  genes with probability 1.  This method follows the paper: every property at 0.2, and at 0.2 one
  cut, between nuclear genes.
- The code draws parents by roulette over the fronts, and flies ten survivors again beside ten
  children.  This method follows the paper: the best 20 of parents and children are the next
  parents, each once.  None is flown again, because a scenario always gives the same flight.
- The paper counts an object's start as one scalar.  Here it is two, each mutated on its own.
- Algorithm 1 varies a gene if a random number exceeds the threshold of 0.2, four times in five.
  This method takes 0.2 as the rate, as the code does for the mutation.
- Without a landing the code takes ten seconds for the time to landing; the paper says nothing.
  This method takes the duration of the flight, because the objective rewards long flights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import FlownScenario, Method, MethodDeclaration, SearchPlan
from pytest_garl.search.objectives import diversity, time_to_landing_s
from pytest_garl.search.operators import Matrix, property_mutation


def make(plan: SearchPlan) -> Method:
    """Start the search."""
    # pymoo takes a second to import.
    from pytest_garl.search.nsga2 import Nsga2

    return Nsga2("garl-paper", plan, objectives, objective_count=3, mutation=property_mutation)


def objectives(chromosomes: Matrix, flown: Sequence[FlownScenario]) -> Matrix:
    """Distance to landing, time to landing and diversity, all maximised; shape (k, 3)."""
    distance = [item.result.final_distance_m for item in flown]
    times = [time_to_landing_s(item.result) for item in flown]
    return np.column_stack([distance, times, diversity(chromosomes)])


METHOD = MethodDeclaration(make=make, policy="dqn-paper")
