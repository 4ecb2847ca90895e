"""A flight that begins in the air."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl import Command, Land, Observation, VelocitySetpoint
from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.bodies import discs_of
from pytest_garl.scenarios.placed import UAV_CLEARANCE_M, Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.nominal import nominal_arrival_s
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.flights import EMPTY, LAWN, STAND, Scripted, nominal

pytestmark = pytest.mark.sim


def hovering(height_m: float = 10.0, x: float = 2.0, y: float = -1.0, **genes: float) -> Scenario:
    start = Start(mode="hover", height_m=height_m, offset_m=(x, y))
    scenario: Scenario = dataclasses.replace(nominal(**genes), task=Task(start=start))
    return scenario


class OnlyLands(Scripted):
    def step(self, observation: Observation) -> Command:
        return Land(speed_mps=1.0)


class Waits(Scripted):
    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, 0.0), yaw_rad=None)


def test_a_hover_begins_at_its_offset_from_the_told_coordinate() -> None:
    scenario = hovering(8.0, told__error_m=3.0)
    flight = fly(scenario, Waits, STAND, map=EMPTY, time_limit_s=3.0)
    assert Placed(scenario, EMPTY).start_m == pytest.approx((5.0, -1.0, 8.0))
    away = np.linalg.norm(flight.uav.position_m - np.array([5.0, -1.0, 8.0]), axis=1)
    assert away.max() < 0.05
    assert not [event for event in flight.events if event.name == "took_off"]


def test_a_hover_is_held_until_the_first_command() -> None:
    scenario = hovering(8.0, timing__latency_ms=1000.0)
    flight = fly(scenario, Waits, STAND, map=EMPTY, time_limit_s=1.0)
    assert not flight.steps
    assert flight.uav.position_m[:, 2].min() > 7.95


def test_a_system_that_only_lands_can_land_from_a_hover() -> None:
    flight = fly(hovering(6.0, heading__start_deg=90.0), OnlyLands, STAND, map=EMPTY)
    assert flight.outcome == "landed"
    assert flight.touchdown is not None
    assert flight.touchdown.position_m[:2] == pytest.approx((2.0, -1.0), abs=0.2)
    _, _, z, w = flight.uav.attitude[-1]
    assert math.degrees(2 * math.atan2(z, w)) == pytest.approx(90.0, abs=2.0)


def test_the_reference_pilot_arrives_when_a_nominal_flight_does() -> None:
    scenario = hovering(4.0, x=8.0)
    flight = fly(scenario, ReferencePilot, STAND, map=EMPTY)
    assert flight.outcome == "landed"
    above = np.linalg.norm(flight.uav.position_m[:, :2] - flight.marker_position_m, axis=1) < 0.3
    arrived_s = float(flight.uav.time_s[above][0])
    assert nominal_arrival_s(Placed(scenario, EMPTY)) == pytest.approx(arrived_s, abs=1.5)


def test_a_hover_in_a_tree_begins_beside_it() -> None:
    disc = max((d for body in LAWN.bodies for d in discs_of(body)), key=lambda d: d.high_m)
    x, y, z = Placed(hovering(disc.high_m, x=disc.x_m, y=disc.y_m), LAWN).start_m
    assert 0 < math.hypot(x - disc.x_m, y - disc.y_m) < 6
    assert z == disc.high_m
    flight = fly(hovering(disc.high_m, x=disc.x_m, y=disc.y_m), Waits, STAND, map=EMPTY)
    assert flight.outcome == "not_landed"
    assert min(item.distance_m for item in flight.separations) > UAV_CLEARANCE_M - 0.7


@pytest.mark.parametrize("height_m", [0.5, 500.0, math.nan])
def test_a_height_at_which_no_flight_can_begin_is_refused(height_m: float) -> None:
    with pytest.raises(ScenarioError, match="expected 2 to 100 m"):
        hovering(height_m)
