"""Draw one flight each in which an NPC policy hits the UAV with a person, a dog and a bird.

``python -m lab.pictures.npc_sheets`` flies OpenCV-MLS through random scenarios with one object in
clear weather until that object is hit, writes its last seconds to ``.garl/npc-<type>.png`` and
prints the positions of UAV and object.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import cv2
import numpy as np

from lab.pictures.flight_sheet import sheet
from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups import WEATHER
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.camera.renderer import Renderer
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.randomness import generator
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits

MAPS = {"person": "court", "dog": "lawn", "bird": "court"}
TRIES = 40
SEED = 99


def first_hit(map: Map, policy: str) -> tuple[Scenario, Flight] | None:
    """Return the first scenario in which the UAV and the object collide, and its flight."""
    clear = dict.fromkeys(WEATHER, 0.0)
    for candidate in random_scenarios(map, genome_for(map), SEED, 0, TRIES):
        scenario = candidate.replace(clear)
        flight = fly(scenario, OpenCvLandingSystem, policy_spec(policy), map=map)
        if flight.outcome == "collision" and flight.contacts[-1].body_class == "dynamic":
            return scenario, flight
    return None


def main() -> None:
    """Write a picture and print a table for each type of object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--npcs", default="dqn")
    parser.add_argument("--out", type=Path, default=Path(".garl"))
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    for type_name, name in MAPS.items():
        map = dataclasses.replace(load_map(name), objects=((type_name, 1),))
        found = first_hit(map, arguments.npcs)
        if found is None:
            print(f"{type_name}: none of {TRIES} flights hit it")
            continue
        scenario, flight = found
        renderer = Renderer(Placed(scenario, map), Camera(), generator(scenario.seed, "sensor"))
        target = arguments.out / f"npc-{type_name}.png"
        target.parent.mkdir(parents=True, exist_ok=True)
        picture = sheet(flight, renderer, 0.6)
        cv2.imwrite(str(target), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        print(f"{target}: {judge(flight, Limits()).story}")
        uav, npc = flight.uav, flight.objects[0].track
        for row in np.flatnonzero(uav.time_s > flight.elapsed_s - 5)[::12]:
            speed = np.hypot(*npc.velocity_mps[row, :2])
            where = np.round(npc.position_m[row], 1), np.round(uav.position_m[row], 1)
            motion = f"{type_name} {where[0]} {speed:.1f} m/s"
            print(f"  {uav.time_s[row]:5.1f} s  {motion}  UAV {where[1]}")


if __name__ == "__main__":
    main()
