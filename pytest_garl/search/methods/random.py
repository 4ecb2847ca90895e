"""random: every scenario is drawn uniformly and repaired.

The paper's first baseline: "all the static environments are randomly generated", and so are the
starts and destinations of NPCs.  In its code the NPCs never move.  This method follows the paper:
the policy ``waypoint`` walks each NPC to a random place.  The paper does not say what happens then;
here the NPC walks on to the next random place, because NPCs that stand still would make the
baseline weaker.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import Genome
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import FlownScenario, MethodDeclaration, SearchPlan
from pytest_garl.search.seeding import seed_sequence


class RandomSearch:
    """Learns nothing: a generation does not depend on the ones before."""

    learns = False
    overlaps = False

    def __init__(self, plan: SearchPlan) -> None:
        self._plan, self._generation = plan, 0

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        plan = self._plan
        self._generation += 1
        return random_scenarios(
            plan.map, plan.genome, plan.seed, self._generation - 1, plan.population
        )

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Return each flight's distance and time to landing."""
        return [(item.result.final_distance_m, item.result.elapsed_s) for item in flown]


def random_scenarios(
    map: Map, genome: Genome, seed: int, generation: int, size: int
) -> Sequence[Scenario]:
    """Return a generation, which depends only on the seed, the map and the generation's number.

    All landing systems get the same scenarios, so that they can be compared.
    """
    rng = np.random.default_rng(seed_sequence("random", map.name, seed, generation))
    scenarios = []
    for _ in range(size):
        chromosome = genome.random(rng)
        scenario_seed = int(rng.integers(2**32))
        scenarios.append(repair(decode(chromosome, genome, map=map.name, seed=scenario_seed), map))
    return scenarios


METHOD = MethodDeclaration(make=RandomSearch, policy="waypoint")
