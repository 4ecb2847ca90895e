"""A UAV that holds its place: what the landing system commands is recorded and not flown."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from pytest_garl import Abort, Command, Land, Mission, MotorThrusts, Observation, VehicleState
from pytest_garl.airframe import Airframe
from pytest_garl.flight.flight import Flight
from pytest_garl.scenarios.task import HOLD_S, Start, Task
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Scripted, nominal

pytestmark = pytest.mark.sim


def flown(system: type, time_limit_s: float = 120.0, **genes: float) -> Flight:
    start = Start(mode="hold", height_m=5.0, offset_m=(1.0, -1.0))
    scenario = dataclasses.replace(nominal(**genes), task=Task(start=start))
    return fly(scenario, system, STAND, map=EMPTY, time_limit_s=time_limit_s)


class Lands(Scripted):
    def step(self, observation: Observation) -> Command:
        return Land(speed_mps=2.0)


class Falls(Lands):
    airframe = Airframe(latency_s=0.0, control_rate_hz=240)

    def control(self, state: VehicleState) -> MotorThrusts:
        return MotorThrusts(newtons=(0.0, 0.0, 0.0, 0.0))


class GivesUp(Scripted):
    def step(self, observation: Observation) -> Command:
        return Abort() if observation.time_s > 2.0 else Land()


class Raises(Scripted):
    def step(self, observation: Observation) -> Command:
        if observation.time_s > 2.0:
            raise ValueError("no trajectory")
        return Land()


class KeepsItsMission(Scripted):
    got: Any = None

    def reset(self, mission: Mission) -> None:
        type(self).got = mission

    def step(self, observation: Observation) -> Command:
        return Land()


@pytest.mark.parametrize("system", [Lands, Falls])
def test_nothing_that_is_commanded_is_flown(system: type) -> None:
    flight = flown(system)
    assert flight.outcome == "held"
    assert flight.elapsed_s == pytest.approx(HOLD_S, abs=0.01)
    away = np.linalg.norm(flight.uav.position_m - np.array([1.0, -1.0, 5.0]), axis=1)
    assert away.max() < 0.05
    assert {step.command for step in flight.steps} == {"Land"}
    assert [event.name for event in flight.events] == ["holds"]


def test_a_held_flight_ends_at_a_time_limit_before() -> None:
    assert flown(Lands, time_limit_s=3.0).elapsed_s == pytest.approx(3.0, abs=0.01)


def test_it_comes_back_to_its_place_in_wind() -> None:
    flight = flown(Lands, wind__mean_mps=6.0)
    away = np.linalg.norm(flight.uav.position_m - np.array([1.0, -1.0, 5.0]), axis=1)
    assert 0.05 < away.max() < 1.5
    assert away[-1] < 0.3


def test_an_abort_ends_it_at_once() -> None:
    flight = flown(GivesUp)
    assert flight.outcome == "gave_up"
    assert flight.elapsed_s == pytest.approx(2.1, abs=0.15)
    assert [event.name for event in flight.events] == ["holds", "abort_command"]


def test_an_exception_ends_it() -> None:
    flight = flown(Raises)
    assert flight.outcome == "crashed"
    assert flight.crash is not None
    assert flight.crash.error == "ValueError"


def test_the_mission_searches_from_the_height_at_which_it_hovers() -> None:
    """A system that first climbs to 10 m would plan nothing."""
    flown(KeepsItsMission, time_limit_s=1.0)
    assert KeepsItsMission.got.search_altitude_m == 5.0
    assert KeepsItsMission.got.home_m == pytest.approx((1.0, -1.0, 5.0))
    assert KeepsItsMission.got.time_limit_s == 1.0
