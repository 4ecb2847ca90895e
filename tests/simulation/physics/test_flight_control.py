"""The flight control of systems that give setpoints."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Airframe,
    Command,
    Land,
    Observation,
    PositionSetpoint,
)
from pytest_garl.simulation.fly import fly
from tests.support.answers import flight_of
from tests.support.flights import EMPTY, STAND, Hovers, Scripted, nominal


def test_the_vehicle_holds_its_place_in_wind() -> None:
    flight = fly(nominal(wind__mean_mps=5.0), Hovers, STAND, map=EMPTY, time_limit_s=20)
    late = flight.uav.position_m[flight.uav.time_s > 12]
    error = np.linalg.norm(late - np.array([0.0, -16.5, 3.0]), axis=1)
    assert error.max() < 0.2


def test_a_step_in_position_does_not_overshoot() -> None:
    flight = fly(nominal(), Hovers, STAND, map=EMPTY, time_limit_s=15)
    assert flight.uav.position_m[:, 2].max() < 3.0 + 0.05 * 2.8
    assert flight.uav.position_m[-1, 2] == pytest.approx(3.0, abs=0.1)


class Turns(Scripted):
    """Turns its nose, then gives the landing to the flight control."""

    last: Command

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 4:
            return dataclasses.replace(self.hover(3.0), yaw_rad=1.0)
        return self.last


@pytest.mark.parametrize("last", [Land(), Abort()])
def test_landing_and_aborting_keep_the_yaw(last: Command) -> None:
    flight = flight_of(type("Turns", (Turns,), {"last": last}), 8)
    x, y, z, w = flight.uav.attitude[-1]
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(1.0, abs=0.05)


def test_abort_keeps_the_yaw_that_a_system_with_its_own_control_was_flying() -> None:
    from pytest_garl.simulation.physics.flight_control import FlightControl
    from pytest_garl.simulation.physics.vehicle import Motion, vehicle_model

    control = FlightControl(vehicle_model(Airframe()))
    half = math.sin(0.5), math.cos(0.5)
    turned = Motion((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 0.0, *half), (0.0, 0.0, 0.0))
    control.remember_yaw(PositionSetpoint(position_m=(0.0, 0.0, 5.0), yaw_rad=1.0))
    control.remember_yaw(Abort())
    fl, fr, rr, rl = control.thrusts(turned, Abort(), 1 / 240)
    assert fl + rr == pytest.approx(fr + rl)


@pytest.fixture(autouse=True)
def _no_numpy_warnings() -> Iterator[None]:
    with np.errstate(all="raise"):
        yield


class GoesAcross(Scripted):
    """Takes off, then crosses 8 m under limits of its own."""

    acceleration_mps2: ClassVar[float | None] = None
    tilt_rad: ClassVar[float | None] = None

    def step(self, observation: Observation) -> Command:
        if observation.time_s < 5:
            return self.hover(5.0)
        goal = (self.home[0], self.home[1] + 8.0, 5.0)
        return PositionSetpoint(
            position_m=goal,
            speed_mps=4.0,
            acceleration_mps2=self.acceleration_mps2,
            tilt_rad=self.tilt_rad,
        )


def crossing(**limits: float) -> tuple[float, float, float]:
    """Return the highest acceleration (over 0.5 s) and tilt of a crossing, and its overshoot."""
    flight = flight_of(type("GoesAcross", (GoesAcross,), limits), 25)
    track = flight.uav
    away = track.time_s > 5
    velocity, (x, y) = track.velocity_mps[away, :2], track.attitude[away, :2].T
    half_second = 12
    change = np.linalg.norm(velocity[half_second:] - velocity[:-half_second], axis=1)
    tilt = np.arccos(1 - 2 * (x * x + y * y))
    overshoot = track.position_m[:, 1].max() - (-16.5 + 8.0)
    assert track.position_m[-1, 1] == pytest.approx(-8.5, abs=0.1)
    return float(change.max() / 0.5), float(tilt.max()), float(overshoot)


@pytest.mark.parametrize("limit", [0.5, 1.0, 2.0])
def test_a_setpoint_limits_its_acceleration_and_does_not_overshoot(limit: float) -> None:
    acceleration, _, overshoot = crossing(acceleration_mps2=limit)
    assert 0.8 * limit < acceleration < 1.15 * limit
    assert overshoot < 0.3


def test_a_setpoint_limits_its_tilt() -> None:
    _, free, _ = crossing()
    _, limited, _ = crossing(tilt_rad=0.1)
    assert free > 0.3
    assert limited < 0.12


class HoldsItsYaw(Scripted):
    def step(self, observation: Observation) -> Command:
        yaw = 1.0 if 2 < observation.time_s < 5 else None
        return dataclasses.replace(self.hover(3.0), yaw_rad=yaw)


def test_a_yaw_of_none_holds_the_yaw_commanded_last() -> None:
    track = flight_of(HoldsItsYaw, 9).uav
    x, y, z, w = track.attitude.T
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    assert np.abs(yaw[track.time_s < 2]).max() < 0.02
    assert yaw[track.time_s > 7] == pytest.approx(1.0, abs=0.05)
