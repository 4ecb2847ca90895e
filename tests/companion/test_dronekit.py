"""Real dronekit over the link: its threads, its listeners and its commands, in simulated time.

``make test-dronekit`` installs it (the fork dronekit2, which runs on today's Python) and sets
DRONEKIT_PYTHON to the Python that has it.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pytest_garl.airframe import Camera
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly
from tests.companion.processes import script

PYTHON = os.environ.get("DRONEKIT_PYTHON")
pytestmark = pytest.mark.skipif(
    PYTHON is None, reason="needs dronekit in a Python of its own: run make test-dronekit"
)
LANDER = """
import sys, time
from dronekit import LocationGlobalRelative, VehicleMode, connect

vehicle = connect("udp:127.0.0.1:14550", wait_ready=True)
heights = []
vehicle.add_attribute_listener("location.global_relative_frame", lambda *seen: heights.append(seen))
while not vehicle.is_armable:
    time.sleep(0.5)
vehicle.mode = VehicleMode("GUIDED")
vehicle.armed = True
while not vehicle.armed:
    time.sleep(0.5)
vehicle.simple_takeoff(6)
while vehicle.location.global_relative_frame.alt < 5.5:
    time.sleep(0.2)
vehicle.simple_goto(LocationGlobalRelative(float(sys.argv[1]), float(sys.argv[2]), 6))
time.sleep(10)
print("parameter", vehicle.parameters["LAND_SPEED"], "heard", len(heights) > 10)
vehicle.mode = VehicleMode("LAND")
while vehicle.armed:
    time.sleep(1)
print("disarmed")
"""


def test_real_dronekit_takes_off_goes_to_a_place_and_lands_twice_alike(tmp_path: Path) -> None:
    script(tmp_path, LANDER, "dk_lander.py")
    program = CompanionProgram(
        "python dk_lander.py {lat_deg} {lon_deg}",
        folder=tmp_path,
        camera=Camera(width_px=32, height_px=24),
        python=PYTHON,
    )
    map = load_map("lawn")
    task = Task(marker=map.marker, start=Start())
    scenario = clear_scenario(map, task, domain_with_policy("calm", tmp_path))
    first, second = (fly(scenario, program, policy_spec("stationary"), map=map) for _ in range(2))
    notes = "\n".join(each.diagnostics.note for each in first.steps if each.diagnostics)
    assert "parameter 50.0 heard True" in notes
    assert first.crash is None
    assert first.touchdown is not None
    # simple_goto sends degrees as 32-bit floats.
    assert first.touchdown.distance_m < 1.0
    assert first.sha256 == second.sha256
