"""The estimate of the UAV's state: how it errs, and that all who act on it get the same."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl import Abort, Airframe, Command, Mission, Observation, VehicleState
from pytest_garl.landing_system import MotorThrusts
from pytest_garl.scenarios.placed import Placed
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.landing_moments import LandingMoments
from pytest_garl.simulation.navigation import LAG_S, MOST_RATE_MPS, Navigation, error_m_at
from pytest_garl.simulation.physics.vehicle import Motion
from pytest_garl.simulation.physics.world import PHYSICS_RATE_HZ
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.flights import EMPTY, STAND, Hovers, Scripted, nominal

LEVEL = (0.0, 0.0, 0.0, 1.0)
REST = Motion((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), LEVEL, (0.0, 0.0, 0.0))


def estimates(seconds: float, seed: int = 5, **genes: float) -> list[Motion]:
    """Return what navigation says of a UAV at rest, for each step of the physics."""
    named = {key if "__" in key else f"navigation__{key}": each for key, each in genes.items()}
    navigation = Navigation(dataclasses.replace(nominal(**named), seed=seed), LandingMoments())
    ticks = range(round(seconds * PHYSICS_RATE_HZ))
    return [navigation.estimate(tick, REST) for tick in ticks]


def errors_m(motions: list[Motion]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = np.array([each.position_m for each in motions]) - REST.position_m
    return found


def test_nothing_errs_by_default() -> None:
    assert estimates(1.0)[-1] is REST


def test_the_error_begins_as_named_and_the_height_without_one() -> None:
    first = estimates(0.01, position_m=2.0, towards_deg=90.0, height_m=0.5)[0]
    assert errors_m([first])[0] == pytest.approx((0.0, 2.0, 0.0), abs=1e-9)


def test_the_error_has_its_root_mean_square_and_its_correlation_time() -> None:
    # Small enough that the largest rate does not matter.
    genes = {"position_m": 0.5, "correlation_s": 30.0}
    named = {f"navigation__{key}": each for key, each in genes.items()}
    navigation, places = Navigation(nominal(**named), LandingMoments()), []
    for tick in range(4000 * PHYSICS_RATE_HZ):
        motion = navigation.estimate(tick, REST)
        if tick % PHYSICS_RATE_HZ == 0:
            places.append(motion.position_m)
    errors = (np.array(places) - REST.position_m)[:, :2]
    # 4000 s hold some 50 independent errors of each axis: the figures are known to a tenth.
    rms = math.sqrt(np.mean(np.sum(np.square(errors), axis=1)))
    assert rms == pytest.approx(0.5, rel=0.08)
    tau, variance = 30.0, float(np.mean(np.square(errors)))
    for apart_s in (15, 30, 60):
        like = float(np.mean(errors[apart_s:] * errors[:-apart_s])) / variance
        # Of a process with this correlation time that passes a lag.
        decays = tau * math.exp(-apart_s / tau) - LAG_S * math.exp(-apart_s / LAG_S)
        assert like == pytest.approx(decays / (tau - LAG_S), abs=0.1)


def test_the_error_at_a_time_is_that_of_the_flight() -> None:
    scenario = dataclasses.replace(
        nominal(navigation__position_m=2.0, navigation__correlation_s=30.0, jump__distance_m=1.0),
        seed=5,
    )
    flown = errors_m(
        estimates(10.0, position_m=2.0, correlation_s=30.0, jump__distance_m=1.0, seed=5)
    )
    start = LandingMoments()
    expected = pytest.approx(tuple(flown[9 * PHYSICS_RATE_HZ]))
    assert error_m_at(scenario, 9.0, start) == expected
    assert math.dist(error_m_at(scenario, 0.0, start), (3.0, 0.0, 0.0)) < 1e-6


def test_the_estimated_velocity_is_the_derivative_of_the_estimated_position() -> None:
    motions = estimates(30.0, position_m=5.0, height_m=1.0, correlation_s=30.0)
    moved = np.diff([each.position_m for each in motions], axis=0) * PHYSICS_RATE_HZ
    said = np.array([each.velocity_mps for each in motions])[1:]
    assert np.abs(moved - said).max() < 1e-9
    assert np.hypot(said[:, 0], said[:, 1]).max() <= MOST_RATE_MPS + 1e-9
    assert np.abs(said).max() > 0.01


def test_yaw_and_tilt_err_as_named() -> None:
    x, y, z, w = estimates(0.01, yaw_deg=8.0)[0].attitude
    assert (x, y) == (0.0, 0.0)
    assert math.degrees(2 * math.atan2(z, w)) == pytest.approx(8.0)
    x, y, z, w = estimates(0.01, tilt_deg=2.0, tilt_towards_deg=90.0)[0].attitude
    assert math.degrees(2 * math.atan2(x, w)) == pytest.approx(2.0)
    assert (y, z) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_one_error_does_not_change_another() -> None:
    alone = errors_m(estimates(20.0, position_m=2.0, correlation_s=30.0))
    both = errors_m(estimates(20.0, position_m=2.0, correlation_s=30.0, height_m=0.5, yaw_deg=3))
    assert np.array_equal(alone[:, :2], both[:, :2])


def test_the_position_jumps_once_and_the_velocity_does_not() -> None:
    motions = estimates(3.0, jump__from_s=1.0, jump__distance_m=4.0, jump__towards_deg=180.0)
    errors = errors_m(motions)
    before, after = errors[PHYSICS_RATE_HZ - 1], errors[PHYSICS_RATE_HZ]
    assert tuple(before) == (0.0, 0.0, 0.0)
    assert after == pytest.approx((-4.0, 0.0, 0.0), abs=1e-9)
    assert errors[-1] == pytest.approx(after)
    assert {each.velocity_mps for each in motions} == {REST.velocity_mps}


BIASED: dict[str, float] = {"navigation__position_m": 2.5, "navigation__yaw_deg": 6.0}


class Listens(Scripted):
    """Hovers by its own estimate, flies no motors, and keeps what it is told."""

    airframe = Airframe(latency_s=0.0, control_rate_hz=240)
    heard: ClassVar[list[Any]] = []
    """Positions: that of home in the mission, then those of observations and states."""

    def reset(self, mission: Mission) -> None:
        super().reset(mission)
        Listens.heard = [np.array(mission.home_m)]

    def step(self, observation: Observation) -> Command:
        Listens.heard.append(observation.position_m)
        return self.hover(3.0)

    def control(self, state: VehicleState) -> MotorThrusts:
        Listens.heard.append(np.array(state.position_m))
        return MotorThrusts(newtons=(1.0, 1.0, 1.0, 1.0))


@pytest.mark.sim
def test_mission_observation_and_vehicle_state_have_the_same_estimate() -> None:
    flight = fly(nominal(**BIASED), Listens, STAND, map=EMPTY, time_limit_s=0.5)
    start = np.array(EMPTY.uav_start_m)
    home, *others = Listens.heard
    assert home - start == pytest.approx((2.5, 0.0, 0.0), abs=1e-6)
    assert len(others) > 50
    # An observation has the noise of RTK on top, 2 cm.
    for position in others:
        assert position[:2] - start[:2] == pytest.approx((2.5, 0.0), abs=0.15)
    assert flight.steps[-1].estimation_error_m[0] == pytest.approx(2.5, abs=0.15)


@pytest.mark.sim
def test_who_holds_its_place_drifts_no_faster_than_the_estimate() -> None:
    scenario = nominal(**BIASED, navigation__correlation_s=30.0, navigation__tilt_deg=2.0)
    flight = fly(scenario, Hovers, STAND, map=EMPTY, time_limit_s=30.0)
    late = flight.uav.time_s > 12.0
    place, home = flight.uav.position_m[late, :2], np.array(EMPTY.uav_start_m[:2])
    assert np.abs(place - home).max() < MOST_RATE_MPS * 30.0
    speeds = np.linalg.norm(np.diff(place, axis=0), axis=1) / np.diff(flight.uav.time_s[late])
    assert speeds.max() < 2 * MOST_RATE_MPS


class GivesUp(Hovers):
    def step(self, observation: Observation) -> Command:
        return Abort() if observation.time_s > 6.0 else super().step(observation)


@pytest.mark.sim
def test_giving_up_climbs_straight_in_spite_of_the_error() -> None:
    flight = fly(nominal(**BIASED), GivesUp, STAND, map=EMPTY, time_limit_s=60.0)
    assert flight.outcome == "gave_up"
    climb = flight.uav.position_m[flight.uav.time_s > 6.0, :2]
    assert np.linalg.norm(climb - climb[0], axis=1).max() < 1.5


@pytest.mark.sim
def test_the_reference_pilot_lands_on_the_marker_whatever_its_estimate_says() -> None:
    scenario = nominal(**BIASED, marker__x=0.3, marker__y=0.2)
    flight = fly(scenario, ReferencePilot, STAND, map=EMPTY, time_limit_s=90.0)
    assert flight.outcome == "landed"
    assert flight.marker_position_m == Placed(scenario, EMPTY).marker_m
    assert flight.final_distance_m < 0.3


@pytest.mark.sim
def test_the_same_seed_gives_the_same_errors() -> None:
    scenario = nominal(**BIASED)
    first, second = (fly(scenario, Hovers, STAND, map=EMPTY, time_limit_s=2.0) for _ in range(2))
    assert first.sha256 == second.sha256
