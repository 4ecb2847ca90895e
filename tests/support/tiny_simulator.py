"""An analytic simulator of microseconds, for tests of everything around the flight."""

from __future__ import annotations

from typing import Any

import numpy as np

from pytest_garl.landing_system import Camera, Mission, Observation
from pytest_garl.scenarios.placement import marker_position_m
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight import Contact, Flight, Track
from pytest_garl.simulation.flight_file import hash_of
from pytest_garl.simulation.system_under_test.calls import crash_of


def fly(
    scenario: Scenario,
    system: Any,
    npcs: Any,
    *,
    map: Any = None,
    time_limit_s: float = 120.0,
    guard: Any = None,
) -> Flight:
    """Fog lets it land off; a fast dog hits it unless it dodges; calls the system once."""
    import dataclasses

    del npcs, time_limit_s
    marker = marker_position_m(scenario, map)
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
    try:
        if guard:
            guard.step_begins()
        pilot = system()
        pilot.reset(_mission())
        pilot.step(_observation())
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


def _observation() -> Observation:
    blank = np.zeros((240, 320), np.float32)
    return Observation(
        time_s=0.0,
        position_m=np.zeros(3),
        velocity_mps=np.zeros(3),
        attitude=np.array([0.0, 0.0, 0.0, 1.0]),
        image=np.zeros((240, 320, 3), np.uint8),
        depth_m=blank,
    )
