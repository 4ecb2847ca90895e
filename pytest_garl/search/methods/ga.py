"""ga: the paper's multi-objective genetic algorithm, with a destination for each NPC as genes.

The paper's second baseline (after Tian et al. 2022, MOSAT), GARL without reinforcement learning:
fitness, chromosome, sorting and crossover are GARL's, "however, this baseline adds the dynamic
object's destination into the dynamic object composite gene and utilizes a standard mutation
strategy".  So everything but genes and mutation is as in ``garl-paper``, including the rates.  The
policy ``destination`` walks each NPC to its destination and back, again and again.

Choices, if paper and code differ or say nothing:

- The code lets an object stand at its destination; the paper says nothing.  Here it turns back,
  which is the stronger rival: a landing system flies around an object that stands, and the NPCs of
  ``random`` never stand either.
- The paper does not say which mutation is standard; the code adds or subtracts a fixed step.  This
  method takes polynomial mutation (Deb and Agrawal 1999), which belongs to the NSGA-II that the
  paper cites (Deb et al. 2002) and, unlike fixed steps, reaches every value.
- The code measures diversity by the weather alone.  This method follows the paper: the whole
  chromosome, including destinations.
- The code crosses the objects over as one list.  This method follows the paper: the border lies
  between nuclear genes, so that an NPC keeps its destination with its start.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.search.method import Method, MethodDeclaration, SearchPlan
from pytest_garl.search.methods.garl_paper import objectives
from pytest_garl.search.operators import MUTATION_PROBABILITY, Matrix

ETA = 20.0
"""Distribution index of the mutation (Deb et al. 2002): steps are mostly below a tenth of the
range."""


def make(plan: SearchPlan) -> Method:
    """Start the search; its genome has a destination for each NPC."""
    from pytest_garl.search.nsga2 import Nsga2

    plan = dataclasses.replace(plan, genome=with_destinations(plan.genome))
    return Nsga2("ga", plan, objectives, objective_count=3, mutation=polynomial_mutation)


def polynomial_mutation(
    offspring: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator
) -> Matrix:
    """Return a copy in which each property moves with the paper's probability of 0.2."""
    from pymoo.operators.mutation.pm import mut_pm

    count = len(offspring)
    rates, indices = np.full(count, MUTATION_PROBABILITY), np.full(count, ETA)
    mutated: Matrix = mut_pm(offspring, lower, upper, indices, rates, False, random_state=rng)
    return mutated


METHOD = MethodDeclaration(make=make, policy="destination")
