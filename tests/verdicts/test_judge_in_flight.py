"""The judge on a flight of the built-in simulator."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from pytest_garl.gate.record import BaselineSpec
from pytest_garl.landing_system import (
    Abort,
    Command,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.support.flights import EMPTY, STAND, Scripted, nominal

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
    off = Evidence(flight, Limits()).off_marker_m
    assert off is not None
    assert f"Touched the ground {off:.1f} m off the marker before it gave up" in verdict.story
    wide = judge(flight, Limits(distance_m=off + 0.5))
    assert (wide.primary, wide.violation_type) == ("time", "II")


def hovering(height_m: float, offset_m: tuple[float, float] = (0.0, 0.0), **genes: float) -> Any:
    start = Start(mode="hover", height_m=height_m, offset_m=offset_m)
    return dataclasses.replace(nominal(**genes), task=Task(start=start))


class TurnsBack(Scripted):
    """Comes down at 1 m/s to 1.2 m beside the marker, and flies up and away."""

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.low = False

    def step(self, observation: Observation) -> Command:
        self.low |= float(observation.position_m[2]) < 1.3
        up_mps = 0.5 if self.low else -1.0
        return VelocitySetpoint(velocity_mps=(1.0 if self.low else 0.0, 0.0, up_mps))


@pytest.mark.sim
def test_a_flight_that_starts_low_in_the_air_has_the_margins_of_one_that_starts_high() -> None:
    def margins(height_m: float) -> dict[str, float]:
        scenario = hovering(height_m, offset_m=(1.0, 0.0))
        flight = fly(scenario, TurnsBack, STAND, map=EMPTY, time_limit_s=height_m + 4.0)
        assert [Evidence(flight).phase_at(at_s) for at_s in (0.2, height_m - 2.5)] == [
            "approach",
            "descent",
        ]
        return {each.property: each.value for each in judge(flight, Limits()).margins}

    low, high = margins(5.0), margins(8.0)
    assert low["distance"] == pytest.approx(-0.25, abs=0.1)
    assert low["touchdown_speed"] == pytest.approx(1.0, abs=0.15)
    for name in ("distance", "touchdown_speed", "touchdown_tilt", "decoy", "slide"):
        assert low[name] == pytest.approx(high[name], abs=0.1), name


class HoldsItsPlace(Scripted):
    """Comes down on the marker and holds its place there; its motors never stop."""

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        self.goal, self.down = mission.gps_position_m, False

    def step(self, observation: Observation) -> Command:
        self.down |= float(observation.position_m[2]) < 0.26
        if not self.down:
            return VelocitySetpoint(velocity_mps=(0.0, 0.0, -0.5))
        return PositionSetpoint(position_m=(*self.goal, 0.22), speed_mps=2.0)


@pytest.mark.sim
def test_a_uav_that_holds_its_place_on_the_ground_is_dragged_when_its_position_jumps() -> None:
    jumps = hovering(3.0, jump__from_s=8.0, jump__distance_m=3.0)
    flight = fly(jumps, HoldsItsPlace, STAND, map=EMPTY, time_limit_s=20.0)
    assert len(flight.earlier_touchdowns) > 0
    verdict = judge(flight, Limits())
    assert verdict.signature == "slid:motors-on"
    assert "stood there with running motors until 8." in verdict.story
    stands = fly(hovering(3.0), HoldsItsPlace, STAND, map=EMPTY, time_limit_s=12.0)
    assert judge(stands, Limits(time_s=12.0)).signature == "late:standing"
