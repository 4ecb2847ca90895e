"""Nominal landings of the foreign systems.

``python -m lab.foreign`` flies each of them on both maps in clear air, without anybody, to
markers whose told coordinate errs, and prints how that ends.
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np

from lab.foreign.catalogue import SYSTEMS, Foreign
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Verdict, default_distance_m

MAPS = ("court", "lawn")
OFF_M = (0.0, 2.0, 4.0)
"""How far east of the marker the told coordinate lies."""


def nominal(foreign: Foreign, map_name: str, off_m: float) -> Scenario:
    """Return a scenario in which nothing acts."""
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map)
    row = [item.nominal for gene in genome.genes for item in gene.properties]
    scenario = decode(np.array(row), genome, map=map_name, seed=1)
    scenario = scenario.replace({"told.error_m": off_m})
    return repair(dataclasses.replace(scenario, task=foreign.task), map)


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    names = [each.name for each in SYSTEMS]
    parser.add_argument("--systems", nargs="+", default=names, choices=names)
    chosen = parser.parse_args().systems
    print("| system | map | coordinate off | outcome | landed off | after | verdict |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for foreign in SYSTEMS:
        if foreign.name not in chosen:
            continue
        if foreign.problem:
            print(f"| {foreign.name} | | | not flown: {foreign.problem} | | | |")
            continue
        for map_name in MAPS:
            for off_m in OFF_M:
                print(row(foreign, map_name, off_m), flush=True)


def flown(foreign: Foreign, scenario: Scenario) -> tuple[Flight, Verdict]:
    """Fly one scenario, without anybody who moves, and judge it."""
    flight = fly(scenario, foreign.system, policy_spec("stationary"))
    distance_m = default_distance_m(foreign.task.marker.side_m)
    return flight, judge(flight, dataclasses.replace(DEFAULT_LIMITS, distance_m=distance_m))


def row(foreign: Foreign, map_name: str, off_m: float) -> str:
    """Fly one scenario and return its row of the table."""
    flight, verdict = flown(foreign, nominal(foreign, map_name, off_m))
    return (
        f"| {foreign.name} | {map_name} | {off_m:.0f} m | {flight.outcome} "
        f"| {flight.final_distance_m:.2f} m | {flight.elapsed_s:.1f} s "
        f"| {verdict.signature or 'good'} |"
    )


if __name__ == "__main__":
    main()
