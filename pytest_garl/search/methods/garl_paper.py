"""garl-paper: the paper's Algorithm 1, with its three objectives and its operators.

GARL as published, for ``garl`` to be measured against: NSGA-II over distance to landing, time to
landing and diversity, with objects that ``dqn-paper`` steers.

Where paper and code differ, or say nothing:

- The code measures diversity by the weather alone, as it is.  Taken is the paper's: the whole
  chromosome, which is normalised so that no property drowns the others.
- The code mutates a property to the candidate farthest from the middle of the violations known.
  Taken is the paper's, farthest from all values of the generation, as it needs no violation first.
- The code mutates rain twice and snow never, crosses the marker with itself, and swaps halves of
  genes with probability 1.  Taken are the paper's: every property at 0.2, and at 0.2 one cut, which
  falls between nuclear genes.
- The code draws parents by roulette over the fronts, and flies ten survivors again beside ten
  children.  Taken is the paper's: the best 20 of parents and children are the next parents, each
  once.  None is flown again, since a scenario gives the same flight.
- The paper counts an object's start as one scalar.  Here it is two, mutated each by itself.
- Algorithm 1 varies where a random number exceeds the threshold of 0.2, four times in five.  Taken
  is 0.2 as the rate, as the code has it for the mutation.
- Without a landing the code takes ten seconds for the time to landing; the paper says nothing.
  Taken is how long the flight was, since the objective is after those that take too long.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_garl.search.method import Flown, Method, MethodDeclaration, SearchPlan
from pytest_garl.search.objectives import diversity
from pytest_garl.search.operators import Matrix, property_mutation


def make(plan: SearchPlan) -> Method:
    """Return the search; populations of 20 and rates of 0.2 as in the paper."""
    # pymoo takes a second to import.
    from pytest_garl.search.nsga2 import Nsga2

    return Nsga2("garl-paper", plan, objectives, 3, property_mutation)


def objectives(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Distance to landing, time to landing and diversity, all maximised; shape (k, 3)."""
    distance = [item.result.final_distance_m for item in flown]
    elapsed = [item.result.elapsed_s for item in flown]
    return np.column_stack([distance, elapsed, diversity(chromosomes)])


METHOD = MethodDeclaration(make=make, policy="dqn-paper")
