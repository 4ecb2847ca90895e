"""Measures what it takes to pass a frame to a program and its answer back, and how fast it flies.

``python -m lab.benchmarks.programs``.  A machine has other work too: of each frame the wall time is
the median of the fastest quarter, and a flight counts the CPU time of both processes.
"""

from __future__ import annotations

import os
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl import CompanionProgram, ExternalProgram, external
from pytest_garl.landing_system import Mission, Observation, VehicleState
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly

DOCS = Path(__file__).parents[2] / "docs" / "your-stack"
CLIENT = Path(external.__file__).parent / "clients" / "garl_client.py"
FRAMES = 300
CONTROLS = 24
"""Control steps from one frame to the next."""
ANSWERS = """
import garl_client
link = garl_client.Link()
for seen in link:
    seen.image
    link.land()
"""
LOOKS = """
import cv2
camera = cv2.VideoCapture(0)
while True:
    camera.read()
"""
LANDS = (
    "python mavlink_lander.py --marker {marker_id} --north {north_m} --east {east_m} "
    "--altitude {search_altitude_m} --focal {focal_px} --dictionary {marker_dictionary}"
)


def frame_s(flight: Any, mission: Mission, *, controlled: bool) -> float:
    """Return the time of a frame at a program that looks at the picture and does nothing else."""
    size = (mission.camera.height_px, mission.camera.width_px)
    place, level, still = (0.0, 0.0, 2.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    seconds = []
    try:
        flight.reset(mission)
        for frame in range(FRAMES):
            time_s = frame * CONTROLS / 240
            seen = Observation(
                time_s=time_s,
                position_m=np.array(place),
                velocity_mps=np.array(still),
                attitude=np.array(level),
                image=np.full((*size, 3), frame % 256, np.uint8),
                depth_m=np.zeros(size, np.float32),
                rangefinder_m=None,
            )
            began = time.perf_counter()
            flight.step(seen)
            seconds.append(time.perf_counter() - began)
            for step in range(CONTROLS if controlled else 0):
                flight.control(
                    VehicleState(
                        time_s=time_s + step / 240,
                        position_m=place,
                        velocity_mps=still,
                        attitude=level,
                        angular_velocity_radps=still,
                        thrusts_n=(0.0,) * 4,
                    )
                )
    finally:
        flight.close()
    return statistics.median(sorted(seconds[FRAMES // 10 :])[: FRAMES // 4])


def main() -> None:
    """Print the times."""
    ground = load_map("lawn")
    task = Task(marker=ground.marker, start=Start())
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(CLIENT, folder)
        (folder / "answers.py").write_text(ANSWERS)
        (folder / "looks.py").write_text(LOOKS)
        scenario = clear_scenario(ground, task, domain_with_policy("calm", folder))
        answers = ExternalProgram([sys.executable, "answers.py"], name="answers", folder=folder)
        looks = CompanionProgram("looks.py", name="looks", folder=folder)
        mission = Mission(
            gps_position_m=(5.0, 5.0),
            home_m=(0.0, 0.0, 0.2),
            search_altitude_m=10.0,
            marker_id=0,
            marker_side_m=1.0,
            marker_dictionary="DICT_5X5_50",
            camera=answers.airframe.camera,
            time_limit_s=60.0,
        )
        for program, controlled in ((answers, False), (looks, True)):
            took_s = frame_s(program(), mission, controlled=controlled)
            print(f"{type(program).__name__}: a frame and its answer take {1000 * took_s:.2f} ms")
    lander = CompanionProgram(LANDS, folder=DOCS)
    began = sum(os.times()[:4])
    flight = fly(scenario, lander, policy_spec("stationary"), map=ground)
    cpu_s = sum(os.times()[:4]) - began
    print(
        f"CompanionProgram: {flight.outcome}, {flight.elapsed_s:.1f} s flown in {cpu_s:.1f} s of "
        f"CPU: {flight.elapsed_s / cpu_s:.1f} times real time"
    )


if __name__ == "__main__":
    main()
