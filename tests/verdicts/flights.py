"""Flights made by hand, for tests of verdicts."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.simulation.flight import Contact, Crash, Flight, Separation, Step, Track


def step(
    time_s: float,
    seen: tuple[str, ...] = (),
    target: Any = None,
    detected: Any = None,
    visible: float = 0.0,
) -> Step:
    found = () if detected is None else (detection(detected),)
    return Step(
        time_s=time_s,
        command="PositionSetpoint",
        marker_visible=visible,
        marker_px=24.0,
        objects_visible=seen,
        diagnostics=Diagnostics(target_m=target, detections=found),
    )


def detection(place: tuple[float, float, float]) -> Detection:
    return Detection(marker_id=0, confidence=1.0, position_m=place)


def flight(outcome: Any, end: tuple[float, float, float], **changes: Any) -> Flight:
    places = np.array([[0.0, -10.0, 10.0], [0.0, 0.0, 10.0], [*end]])
    base = Flight(
        outcome=outcome,
        final_distance_m=float(np.hypot(end[0], end[1])),
        elapsed_s=30.0,
        marker_position_m=(0.0, 0.0),
        uav=Track(
            time_s=np.array([0.0, 10.0, 30.0]),
            position_m=places,
            attitude=np.zeros((3, 4)),
            velocity_mps=np.zeros((3, 3)),
        ),
        objects=(),
        contacts=(),
        separations=(),
        events=(),
        steps=(step(5.0), step(29.5)),
        decoys=(("decoy-marker-3", 4.0, 4.0),),
    )
    return dataclasses.replace(base, **changes)


def touch(time_s: float) -> tuple[Contact, ...]:
    return (dataclasses.replace(hit("ground", "ground", "ground")[0], time_s=time_s),)


def track(*samples: tuple[float, float, float, float]) -> Track:
    """Return a track of (time, x, y, z)."""
    values = np.array(samples)
    return Track(
        time_s=values[:, 0],
        position_m=values[:, 1:],
        attitude=np.zeros((len(values), 4)),
        velocity_mps=np.zeros((len(values), 3)),
    )


def hit(body: str, kind: str, body_class: Any, tilt: float = 0.0) -> tuple[Contact, ...]:
    contact = Contact(
        time_s=30.0,
        body=body,
        kind=kind,
        body_class=body_class,
        position_m=(0.0, 0.0, 1.0),
        speed_mps=2.5,
        tilt_rad=tilt,
    )
    return (contact,)


CRASH = Crash(
    kind="raised", error="PlannerError", message="no", where="planning_ego.plan", traceback=""
)


def gap(body: str, kind: str, body_class: Any, distance_m: float, time_s: float) -> Separation:
    return Separation(
        body=body, kind=kind, body_class=body_class, distance_m=distance_m, time_s=time_s
    )
