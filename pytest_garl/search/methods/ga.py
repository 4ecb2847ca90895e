"""ga: the paper's multi-objective genetic algorithm, whose genes say where each object goes.

The paper's second baseline (after Tian et al. 2022, MOSAT), GARL without reinforcement learning:
fitness, chromosome, sorting and crossover are GARL's, "however, this baseline adds the dynamic
object's destination into the dynamic object composite gene and utilizes a standard mutation
strategy".  So all but genes and mutation is that of ``garl-paper``, rates among it.  The policy
``destination`` walks each object to its destination and back, over and over.

Paper and code differ in four places.  The code lets an object stand at its destination, of which
the paper says nothing; here it turns back, which makes the stronger rival: a system that sees what
stands goes around it, and the objects of ``random`` never stand either.  Which mutation is
standard the paper does not say; the code adds or subtracts a fixed step.  Taken is polynomial
mutation (Deb and Agrawal 1999), which belongs to the NSGA-II that the paper cites (Deb et al.
2002) and reaches every value, as steps from a grid do not.  The code measures diversity by the
weather alone; taken is the whole chromosome, the paper's definition, destinations included.  The
code crosses objects over as one list; taken is the paper's border between nuclear genes, so that
an object keeps its destination with its start.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_garl.scenarios.genes import with_destinations
from pytest_garl.search.method import Method, MethodDeclaration, SearchPlan
from pytest_garl.search.methods.garl_paper import objectives
from pytest_garl.search.operators import MUTATION_PROBABILITY, Matrix

ETA = 20.0
"""Distribution index of the mutation (Deb et al. 2002): steps are mostly below a tenth of the
range."""


def make(plan: SearchPlan) -> Method:
    """Return the search; its genome is the plan's with a destination for each object."""
    from pytest_garl.search.nsga2 import Nsga2

    plan = dataclasses.replace(plan, genome=with_destinations(plan.genome))
    return Nsga2("ga", plan, objectives, 3, polynomial_mutation)


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
