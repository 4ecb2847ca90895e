"""A plain rclpy node in lock-step: the bytes of its rule in a class.

``make test-ros`` installs rclpy (394 MB of wheels) and sets ROS_PYTHON to the Python that has it.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from pytest_garl import Command, Land, Mission, Observation, PositionSetpoint
from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.scenarios.task import DEFAULT_TASK
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly
from tests.external.programs import CLIENTS
from tests.support.flights import LAWN, STAND

PYTHON = os.environ.get("ROS_PYTHON", "")
pytestmark = pytest.mark.skipif(not PYTHON, reason="ROS_PYTHON names no Python with rclpy")
NODE = Path(__file__).parents[2] / "docs" / "your-stack" / "ros2_lander.py"


class InProcess:
    """The rule of the node as a class."""

    def reset(self, mission: Mission) -> None:
        spec = importlib.util.spec_from_file_location("ros2_lander", NODE)
        assert spec is not None
        assert spec.loader is not None
        module: Any = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        self.rule = module.WhiteLander(
            mission.gps_position_m, mission.search_altitude_m, mission.camera.focal_px
        )

    def step(self, observation: Observation) -> Command:
        place, attitude = observation.position_m.tolist(), observation.attitude.tolist()
        goal = self.rule(observation.image, place, attitude)
        return PositionSetpoint(position_m=goal, speed_mps=1.5) if goal else Land()


def flown(system: Any, folder: Path) -> Flight:
    scenario = clear_scenario(LAWN, DEFAULT_TASK, domain_with_policy("field", folder))
    return fly(scenario, system, STAND, map=LAWN)


def bridged(folder: Path, *node: str) -> ExternalProgram:
    for file in (CLIENTS / "garl_ros2.py", CLIENTS / "garl_client.py", NODE):
        shutil.copy(file, folder)
    python = str(Path(PYTHON).absolute())
    command = [python, "garl_ros2.py", "--speed=1.5", *(node or (python, "ros2_lander.py"))]
    return ExternalProgram(
        [*command, "--ros-args", "-p", "use_sim_time:=true"], name="ros", folder=folder
    )


def test_a_node_flies_to_the_byte_as_its_rule_in_a_class(tmp_path: Path) -> None:
    by_node, by_class = flown(bridged(tmp_path), tmp_path), flown(InProcess, tmp_path)
    assert (by_node.outcome, by_node.crash) == ("landed", None)
    assert by_node.sha256 == by_class.sha256


def test_a_node_that_ends_is_a_finding(tmp_path: Path) -> None:
    crash = flown(bridged(tmp_path, sys.executable, "-c", "raise SystemExit(7)"), tmp_path).crash
    assert crash is not None
    assert (crash.kind, crash.error) == ("died", "exit-status-1")
    assert "the node ended with status 7" in crash.traceback
