"""The rangefinder: what it measures, in which range, and that nobody has one by default."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np
import pytest

from pytest_garl import Airframe, Command, Observation, PositionSetpoint, Rangefinder
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M
from pytest_garl.scenarios.bodies import Body, Part
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.physics.flight_control import MAX_TILT_RAD
from pytest_garl.simulation.physics.make_world import make_world
from pytest_garl.simulation.physics.vehicle import Motion, vehicle_model
from pytest_garl.simulation.rangefinder import NOISE_M, Ranging
from tests.support.engines import engine
from tests.support.flights import EMPTY, STAND, Scripted, nominal

__all__ = ["engine"]
pytestmark = [pytest.mark.sim, pytest.mark.usefixtures("engine")]

UAV = vehicle_model(Airframe())
LEVEL = (0.0, 0.0, 0.0, 1.0)
BOX = Body(
    name="box",
    kind="bench",
    position_m=(3.0, 0.0, 0.0),
    parts=(Part(shape="box", size_m=(1.0, 1.0, 2.0), position_m=(0.0, 0.0, 1.0)),),
)


def reading_m(
    place: tuple[float, float, float],
    attitude: tuple[float, float, float, float] = LEVEL,
    rangefinder: Rangefinder | None = None,
) -> float | None:
    """Return what the rangefinder says of a place above the ground and a box."""
    world = make_world(UAV, (0.0, 0.0, 0.0), (BOX,), (), 1.0)
    try:
        world.place_uav(place, attitude)
        ranging = Ranging(nominal(), rangefinder or Rangefinder(), world)
        return ranging.reading_m(Motion(place, (0.0, 0.0, 0.0), attitude, (0.0, 0.0, 0.0)))
    finally:
        world.close()


def test_the_rangefinder_measures_the_height_of_the_camera_above_the_ground() -> None:
    assert reading_m((0.0, 0.0, 10.0)) == pytest.approx(9.95, abs=4 * NOISE_M)


def test_the_rangefinder_measures_to_what_lies_below() -> None:
    assert reading_m((3.0, 0.0, 10.0)) == pytest.approx(7.95, abs=4 * NOISE_M)


def test_the_rangefinder_measures_along_the_axis_of_the_body() -> None:
    half = MAX_TILT_RAD / 2
    tilted = reading_m((0.0, 20.0, 10.0), (math.sin(half), 0.0, 0.0, math.cos(half)))
    assert tilted == pytest.approx(10.0 / math.cos(MAX_TILT_RAD) - 0.05, abs=4 * NOISE_M)


def test_the_rangefinder_reads_nothing_out_of_its_range() -> None:
    near = Rangefinder(least_m=0.3, most_m=6.0)
    assert reading_m((0.0, 0.0, 6.2), rangefinder=near) is None
    assert reading_m((0.0, 0.0, 5.8), rangefinder=near) is not None
    assert reading_m((0.0, 0.0, BODY_ABOVE_FEET_M), rangefinder=near) is None


class Climbs(Scripted):
    """Climbs to 6 m, and keeps its observations; its image is never looked at."""

    seen: ClassVar[list[Observation]] = []

    def reset(self, mission: Any) -> None:
        super().reset(mission)
        Climbs.seen = []

    def step(self, observation: Observation) -> Command:
        Climbs.seen.append(observation)
        return self.hover(6.0)


class Measures(Climbs):
    airframe = Airframe(latency_s=0.0, rangefinder=Rangefinder())


class MeasuresAndDescends(Measures):
    """Stops 2 m above what it measures."""

    def step(self, observation: Observation) -> Command:
        Climbs.seen.append(observation)
        height = float(observation.position_m[2]) + 2.0 - (observation.rangefinder_m or 0.0)
        return PositionSetpoint(position_m=(*self.home[:2], height))


def test_only_an_airframe_with_a_rangefinder_has_readings_and_flies_the_same() -> None:
    flights = [fly(nominal(), each, STAND, map=EMPTY, time_limit_s=4.0) for each in (Climbs,)]
    assert {each.rangefinder_m for each in Climbs.seen} == {None}
    flights.append(fly(nominal(), Measures, STAND, map=EMPTY, time_limit_s=4.0))
    readings = [each.rangefinder_m for each in Measures.seen[15:]]
    heights = [float(each.position_m[2]) for each in Measures.seen[15:]]
    assert readings == pytest.approx(np.array(heights) - 0.05, abs=0.25)
    assert flights[0].sha256 == flights[1].sha256
    # The record holds what the landing system got.
    assert {step.rangefinder_m for step in flights[0].steps} == {None}
    assert [s.rangefinder_m for s in flights[1].steps] == [o.rangefinder_m for o in Measures.seen]
    assert [each.rangefinder for each in flights] == [None, Rangefinder()]


def test_readings_show_the_true_height_when_the_estimated_one_errs() -> None:
    scenario = nominal(navigation__height_m=5.0, navigation__correlation_s=30.0)
    flight = fly(scenario, MeasuresAndDescends, STAND, map=EMPTY, time_limit_s=40.0)
    errors = np.array([step.estimation_error_m[2] for step in flight.steps])
    assert np.abs(errors[-50:]).max() > 0.5
    assert flight.uav.position_m[-1, 2] == pytest.approx(2.05, abs=0.3)


def test_the_same_seed_gives_the_same_readings() -> None:
    def readings() -> list[float | None]:
        fly(nominal(), Measures, STAND, map=EMPTY, time_limit_s=2.0)
        return [each.rangefinder_m for each in Measures.seen]

    assert readings() == readings()
    other = dataclasses.replace(nominal(), seed=6)
    first = readings()
    fly(other, Measures, STAND, map=EMPTY, time_limit_s=2.0)
    assert first != [each.rangefinder_m for each in Measures.seen]
