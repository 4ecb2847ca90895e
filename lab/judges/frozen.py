"""Fly one search of the arm `exploring`: a script that an older commit's work tree runs.

It imports nothing of the lab, and only what that commit has as well.  It prints a line of JSON for
each flight: its scenario, and whether it violates a property.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.reference import Reference
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import EXPLORING, Garl
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS


def main(system: str, map_name: str, seed: int, flights: int, population: int) -> None:
    """Fly the search."""
    import cv2

    cv2.setNumThreads(1)
    module, _, name = system.partition(":")
    made = Reference(module=module, file="", qualname=name).load()
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map)
    # That commit plans without the number of flights.
    task: dict[str, Any] = {"map": map, "genome": genome, "seed": seed, "population": population}
    plan = SearchPlan(**task)
    method, npcs, flown = Garl(plan, EXPLORING), policy_spec("graded"), 0
    while flown < flights:
        told = []
        for scenario in list(method.ask())[: flights - flown]:
            result = judged(fly(scenario, made, npcs, map=map), DEFAULT_LIMITS)
            told.append(FlownScenario(scenario=scenario, result=result))
            violates = result.verdict.violation
            print(json.dumps({"scenario": dump_scenario(scenario), "violates": violates}))
        flown += len(told)
        if flown < flights:
            method.tell(told)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], *map(int, sys.argv[3:6]))
