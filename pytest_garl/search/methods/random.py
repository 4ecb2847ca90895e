"""random: every scenario drawn uniformly and repaired.

The paper's first baseline: "all the static environments are randomly generated", objects' starts
and destinations too.  In its code the objects never move.  Taken is the paper's: the policy
``waypoint`` walks each to a random place, and then, of which the paper says nothing, to the next;
objects that stand at their first would be the weaker rival.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import Flown, MethodDeclaration, SearchPlan


class RandomSearch:
    """Learns nothing; generation g is the same whatever came before."""

    learns = False

    def __init__(self, plan: SearchPlan) -> None:
        self._plan, self._generation = plan, 0

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        plan = self._plan
        self._generation += 1
        return propose(plan.map, plan.genome, plan.seed, self._generation - 1, plan.population)

    def tell(self, flown: Sequence[Flown]) -> Sequence[tuple[float, ...]]:
        """Return each flight's distance and time to landing."""
        return [(item.result.final_distance_m, item.result.elapsed_s) for item in flown]


def propose(map: Map, genome: Genome, seed: int, generation: int, size: int) -> Sequence[Scenario]:
    """Return a generation; it depends on the seed, the map and the generation alone.

    All landing systems meet the same scenarios, so that they can be compared.
    """
    place = int.from_bytes(hashlib.sha256(f"random {map.name}".encode()).digest()[:4], "big")
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(place, generation)))
    scenarios = []
    for _ in range(size):
        chromosome = genome.random(rng)
        own_seed = int(rng.integers(2**32))
        scenarios.append(repair(decode(chromosome, genome, map=map.name, seed=own_seed), map))
    return scenarios


METHOD = MethodDeclaration(make=RandomSearch, policy="waypoint")
