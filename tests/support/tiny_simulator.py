"""An analytic simulator of microseconds, for tests of everything around the flight."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from pytest_garl.flight.flight import Contact, Flight, Touchdown, Track
from pytest_garl.flight.flight_file import hash_of
from pytest_garl.landing_system import (
    Abort,
    Camera,
    Command,
    Land,
    Mission,
    Observation,
    PositionSetpoint,
)
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.system_under_test.calls import crash_of

STEP_S = 0.5
LONGEST_S = 120.0


def fly(
    scenario: Scenario,
    system: Any,
    npcs: Any,
    *,
    map: Any = None,
    time_limit_s: float = 120.0,
    guard: Any = None,
) -> Flight:
    """Fog lets it land off; a fast dog hits it unless it dodges.

    The system is called once, and further times if its answer is a position or a wish to give up.
    """
    del npcs, time_limit_s
    marker = Placed(scenario, map).marker_m
    outcome: Any = "landed"
    # A reference pilot, which gets the true positions, neither loses its way nor is hit.
    knows = getattr(system, "needs_camera", True) is False
    off = 3.0 if scenario["environment.fog"] > 0.1 and not knows else 0.1
    off = 0.0 if knows else off
    contacts: tuple[Contact, ...] = ()
    crash = None
    dodges = getattr(system, "dodges", False)
    if not dodges and scenario.get("dog-1.velocity", 0.0) > 0.7 and not knows:
        outcome = "collision"
        contacts = (
            Contact(
                time_s=14.2,
                body="dog-1",
                kind="dog",
                body_class="dynamic",
                position_m=(0.0, 0.0, 1.0),
                speed_mps=1.0,
                tilt_rad=0.0,
            ),
        )
    command: Command | None = None
    try:
        if guard:
            guard.step_begins()
        pilot = system()
        pilot.reset(_mission())
        command = pilot.step(_observation())
        if isinstance(command, PositionSetpoint | Abort) and not knows:
            return _fly_positions(pilot, command, marker)
    except Exception as error:  # noqa: BLE001 (as the real simulator does)
        outcome, crash = "crashed", crash_of(error, "step")
    finally:
        if guard:
            guard.step_ends()
    place = np.array([[marker[0] + off, marker[1], 12.0], [marker[0] + off, marker[1], 0.2]])
    flight = Flight(
        outcome=outcome,
        final_distance_m=off,
        elapsed_s=14.2,
        marker_position_m=marker,
        uav=Track(
            time_s=np.array([0.0, 14.2]),
            position_m=place,
            attitude=np.zeros((2, 4)),
            velocity_mps=np.zeros((2, 3)),
        ),
        objects=(),
        contacts=contacts,
        separations=(),
        events=(),
        steps=(),
        crash=crash,
    )
    return dataclasses.replace(flight, sha256=hash_of(flight))


def _fly_positions(pilot: Any, command: Command, marker: tuple[float, float]) -> Flight:
    """Fly a system that flies to positions, comes down there and may give up; nothing hits it."""
    time_s, position = 0.0, (0.0, 0.0, 0.0)
    contacts: list[Contact] = []
    touchdown: Touchdown | None = None
    times, positions = [time_s], [position]
    while not isinstance(command, Abort) and time_s < LONGEST_S:
        time_s += STEP_S
        if isinstance(command, PositionSetpoint):
            position, touchdown = command.position_m, None
        elif isinstance(command, Land):
            position = (position[0], position[1], 0.0)
            if touchdown is None:
                touchdown = _touchdown(time_s, position, marker)
                contacts.append(_ground_contact(time_s, position))
            elif time_s - touchdown.time_s > 3.0:
                break
        times.append(time_s)
        positions.append(position)
        command = pilot.step(_observation(time_s, position))
    stays = isinstance(command, Land) and touchdown is not None
    outcome: Any = "landed" if stays else "not_landed"
    flight = Flight(
        outcome="gave_up" if isinstance(command, Abort) else outcome,
        final_distance_m=math.dist(position[:2], marker),
        elapsed_s=time_s,
        marker_position_m=marker,
        uav=Track(
            time_s=np.array(times),
            position_m=np.array(positions),
            attitude=np.zeros((len(times), 4)),
            velocity_mps=np.zeros((len(times), 3)),
        ),
        objects=(),
        contacts=tuple(contacts),
        separations=(),
        events=(),
        steps=(),
        touchdown=touchdown,
    )
    return dataclasses.replace(flight, sha256=hash_of(flight))


def _touchdown(
    time_s: float, position: tuple[float, float, float], marker: tuple[float, float]
) -> Touchdown:
    return Touchdown(
        time_s=time_s,
        position_m=position,
        distance_m=math.dist(position[:2], marker),
        speed_mps=0.5,
        tilt_rad=0.0,
        on="nothing",
        stopped_s=time_s,
    )


def _ground_contact(time_s: float, position: tuple[float, float, float]) -> Contact:
    return Contact(
        time_s=time_s,
        body="ground",
        kind="ground",
        body_class="ground",
        position_m=position,
        speed_mps=0.5,
        tilt_rad=0.0,
    )


def _mission() -> Mission:
    return Mission(
        gps_position_m=(0.0, 0.0),
        home_m=(0.0, 0.0, 0.0),
        search_altitude_m=10.0,
        marker_id=0,
        marker_side_m=1.5,
        marker_dictionary="DICT_5X5_50",
        camera=Camera(),
        time_limit_s=120.0,
    )


def _observation(
    time_s: float = 0.0, position: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Observation:
    blank = np.zeros((240, 320), np.float32)
    return Observation(
        time_s=time_s,
        position_m=np.array(position),
        velocity_mps=np.zeros(3),
        attitude=np.array([0.0, 0.0, 0.0, 1.0]),
        image=np.zeros((240, 320, 3), np.uint8),
        depth_m=blank,
    )
