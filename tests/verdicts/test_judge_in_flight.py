"""The judge on a flight of the built-in simulator."""

from __future__ import annotations

import math

import pytest

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.baselines.record import BaselineSpec
from pytest_garl.landing_system import Abort, Command, Land, Mission, Observation, PositionSetpoint
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge, off_marker_m
from pytest_garl.verdicts.verdict import Limits

ASIDE_M = 6.0


class TouchesFarOff:
    """Descends beside the coordinate that it is told, touches the ground and gives up."""

    def reset(self, mission: Mission) -> None:
        x, y = mission.gps_position_m
        self.goal = (x + ASIDE_M, y, 5.0)
        self.descends = False

    def step(self, observation: Observation) -> Command:
        x, y, z = (float(value) for value in observation.position_m)
        if self.descends:
            return Abort() if z < 0.2 else Land(speed_mps=1.0)
        self.descends = z > 3.0 and math.dist((x, y), self.goal[:2]) < 0.5
        return PositionSetpoint(position_m=self.goal)


@pytest.mark.sim
def test_a_system_that_touches_the_ground_far_off_and_gives_up_violates_the_distance() -> None:
    map = load_map("lawn")
    (scenario,) = BaselineSpec(count=1).scenarios(map)
    flight = fly(scenario, TouchesFarOff, policy_spec("stand"), map=map)
    verdict = judge(flight, Limits())
    assert flight.outcome == "gave_up"
    assert [each.body for each in flight.contacts] == ["ground"]
    assert (verdict.primary, verdict.violation_type) == ("distance", "I")
    off = off_marker_m(flight, Limits())
    assert off is not None
    assert f"Touched the ground {off:.1f} m off the marker before it gave up" in verdict.story
    wide = judge(flight, Limits(distance_m=off + 0.5))
    assert (wide.primary, wide.violation_type) == ("time", "II")
