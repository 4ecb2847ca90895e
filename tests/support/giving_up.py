"""Landing systems that give up whatever they see, and tests of a landing as the README has them."""

from __future__ import annotations

import pytest

from tests.support.landing_project import project

SYSTEMS = """
import math
from pytest_garl import Abort, Land, PositionSetpoint

class AbortNow:
    def reset(self, mission): pass
    def step(self, observation): return Abort()

class HoverThenAbort:
    def reset(self, mission):
        x, y, z = mission.home_m
        self.goal = PositionSetpoint(position_m=(x, y, z + 8.0))
    def step(self, observation):
        return Abort() if observation.time_s >= 30.0 else self.goal

class TouchFarThenAbort:
    def reset(self, mission):
        x, y = mission.gps_position_m
        self.goal, self.descends = (x + 11.0, y, 5.0), False
    def step(self, observation):
        x, y, z = (float(value) for value in observation.position_m)
        if self.descends:
            return Abort() if z < 0.2 else Land(speed_mps=1.0)
        self.descends = z > 3.0 and math.dist((x, y), self.goal[:2]) < 0.5
        return PositionSetpoint(position_m=self.goal)
"""
HEAD = """
import pytest
from systems import *
pytestmark = pytest.mark.garl(system={system}, maps=["lawn"])
"""
FOUR_TESTS = """
def test_lands_on_the_marker(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m

def test_lands_in_time(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s

def test_collides_with_nothing(landing):
    assert not landing.collisions

def test_completes_the_mission(landing):
    assert landing.completed or landing.excused
"""


def write_four_tests(pytester: pytest.Pytester, system: str) -> None:
    """Write a project whose landing system the README's four tests judge."""
    project(pytester, system)
    with (pytester.path / "systems.py").open("a") as file:
        file.write(SYSTEMS)
    (pytester.path / "test_it.py").write_text(HEAD.format(system=system) + FOUR_TESTS)
