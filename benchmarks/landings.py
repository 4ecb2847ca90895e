"""Proof of the world and of the systems: who lands where nothing should keep it from landing."""

from __future__ import annotations

import argparse
import dataclasses
from multiprocessing import get_context

import cv2
import numpy as np

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.adversary.policies import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import Map, load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.random_search import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.reference_pilot import ReferencePilot

SEED = 1
Task = tuple[str, str, int]


def scenario_of(task: Task) -> tuple[Map, Scenario]:
    """Return what one task flies; it depends on the task alone."""
    who, name, index = task
    map = load_map(name)
    if who == "pilot":
        return map, propose(map, genome_for(map, weather="full"), SEED, index, 1)[0]
    map = dataclasses.replace(map, objects=())
    genome = genome_for(map)
    values = genome.nominal
    values[-2:] = np.random.default_rng([SEED, index]).uniform(-1, 1, 2)
    return map, repair(decode(values, genome, map=name, seed=index), map)


def land(task: Task) -> tuple[Task, bool, str]:
    """Fly one task: whether it landed where it should, and a line about it."""
    cv2.setNumThreads(1)
    map, scenario = scenario_of(task)
    system = ReferencePilot if task[0] == "pilot" else OpenCvLandingSystem
    flight = fly(scenario, system, policy_spec("stationary"), map=map)
    limit = 1.5 if task[0] == "pilot" else 0.3
    good = flight.outcome == "landed" and flight.final_distance_m <= limit
    touched = ", ".join(contact.body for contact in flight.contacts)
    line = f"{flight.outcome} {flight.final_distance_m:.2f} m after {flight.elapsed_s:.0f} s"
    return task, good, f"{line}, touched {touched or 'nothing'}"


def main() -> None:
    """Print the shares of landings, and what happened elsewhere."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="flights per map (default 100)")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    tasks = [
        (who, name, index)
        for who in ("pilot", "opencv")
        for name in ("court", "lawn")
        for index in range(arguments.count)
    ]
    landed: dict[tuple[str, str], int] = {}
    with get_context("spawn").Pool(arguments.workers) as pool:
        for (who, name, index), good, line in pool.imap(land, tasks):
            landed[who, name] = landed.get((who, name), 0) + good
            if not good:
                print(f"  {who} on {name}, {index}: {line}", flush=True)
    print("reference pilot: full weather, standing objects, within 1.5 m")
    print("OpenCV-MLS: clear weather, no objects, within 0.3 m")
    for (who, name), count in landed.items():
        print(f"{who} on {name}: {count} of {arguments.count}")


if __name__ == "__main__":
    main()
