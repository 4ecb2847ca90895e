"""Landings under conditions in which every system should land.

``python -m studies.landings`` prints the share of good flights on each map.  The reference pilot
flies in full weather among standing objects and has to land within 1.5 m.  The landing systems fly
in clear weather without objects and have to land within 0.3 m.  "mm-cubes" is MM-MLS among five
cubes of 2 m at random places, which it must not touch.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
from collections.abc import Callable
from multiprocessing import get_context
from typing import Any

import numpy as np

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.scenarios.bodies import Body, Part
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.start import UAV_CLEARANCE_M
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly

SEED = 1
CUBES, CUBE_M = 5, 2.0
SYSTEMS = {
    "pilot": "pytest_garl.simulation.system_under_test.reference_pilot:ReferencePilot",
    "opencv": "landing_systems.opencv_mls:OpenCvLandingSystem",
    "tphyolo": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    "mm": "landing_systems.mm_mls:MultiModuleLandingSystem",
    "mm-cubes": "landing_systems.mm_mls:MultiModuleLandingSystem",
}
Task = tuple[str, str, int]


def system_of(who: str) -> Callable[[], Any]:
    """Return the landing system's class."""
    module, _, name = SYSTEMS[who].partition(":")
    made: Callable[[], Any] = getattr(importlib.import_module(module), name)
    return made


def scenario_of(task: Task) -> tuple[Map, Scenario]:
    """Return the map and the scenario of a task; they depend on the task alone."""
    who, name, index = task
    map = load_map(name)
    if who == "pilot":
        return map, random_scenarios(map, genome_for(map, weather="full"), SEED, index, 1)[0]
    rng = np.random.default_rng([SEED, index])
    map = dataclasses.replace(map, objects=())
    values = genome_for(map).nominal
    values[-2:] = rng.uniform(-1, 1, 2)
    if who == "mm-cubes":
        map = dataclasses.replace(map, bodies=(*map.bodies, *_cubes(map, rng)))
    scenario = decode(values, genome_for(map), map=name, seed=index)
    return map, repair(scenario, map)


def _cubes(map: Map, rng: np.random.Generator) -> list[Body]:
    """Return cubes around the GPS coordinate, none at the UAV's start."""
    cubes: list[Body] = []
    while len(cubes) < CUBES:
        x, y = (float(at + rng.uniform(-9, 9)) for at in map.gps_position_m)
        if np.hypot(x - map.uav_start_m[0], y - map.uav_start_m[1]) < UAV_CLEARANCE_M + CUBE_M:
            continue
        part = Part(
            shape="box",
            size_m=(CUBE_M, CUBE_M, CUBE_M),
            position_m=(0.0, 0.0, CUBE_M / 2),
            colour=(150, 120, 90),
        )
        cubes.append(
            Body(
                name=f"cube-{len(cubes) + 1}",
                kind="cube",
                parts=(part,),
                position_m=(x, y, 0.0),
                yaw_rad=float(rng.uniform(0, np.pi)),
            )
        )
    return cubes


def land(task: Task) -> tuple[Task, bool, str]:
    """Fly one task; return it, whether the flight was good, and a line about it."""
    import cv2

    cv2.setNumThreads(1)
    map, scenario = scenario_of(task)
    flight = fly(scenario, system_of(task[0]), policy_spec("stationary"), map=map)
    limit = 1.5 if task[0] == "pilot" else 0.3
    good = flight.outcome == "landed" and flight.final_distance_m <= limit
    if task[0] == "mm-cubes":
        good = flight.outcome != "collision"
    touched = ", ".join(contact.body for contact in flight.contacts)
    line = f"{flight.outcome} {flight.final_distance_m:.2f} m after {flight.elapsed_s:.0f} s"
    return task, good, f"{line}, touched {touched or 'nothing'} ({flight.wall_s:.1f} s)"


def main() -> None:
    """Print the share of good flights on each map, and a line for each of the others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="flights per map (default 100)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--who", nargs="+", choices=list(SYSTEMS), default=list(SYSTEMS))
    parser.add_argument("--verbose", action="store_true", help="a line for every flight")
    arguments = parser.parse_args()
    tasks = [
        (who, name, index)
        for who in arguments.who
        for name in ("court", "lawn")
        for index in range(arguments.count)
    ]
    done: dict[tuple[str, str], int] = {}
    with get_context("spawn").Pool(arguments.workers) as pool:
        for (who, name, index), good, line in pool.imap(land, tasks):
            done[who, name] = done.get((who, name), 0) + good
            if arguments.verbose or not good:
                print(f"  {who} on {name}, {index}: {line}", flush=True)
    for (who, name), count in done.items():
        print(f"{who} on {name}: {count} of {arguments.count}")


if __name__ == "__main__":
    main()
