"""Flights made by hand, for tests of verdicts."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from pytest_garl.flight.flight import (
    Contact,
    Crash,
    Flight,
    MarkerView,
    NominalView,
    ObjectRecord,
    Separation,
    Step,
    Touchdown,
    Track,
)
from pytest_garl.landing_system import Detection, Diagnostics

CLEAR = MarkerView(
    share_in_frame=1.0,
    px_per_module=6.0,
    border_hidden=0.0,
    bits_hidden=0.0,
    contrast=150.0,
    noise=1.2,
    blur_px=0.0,
)
"""A marker that any detector reads."""
FOGGY = dataclasses.replace(CLEAR, contrast=0.5)
"""A marker that no detector reads."""


def step(
    time_s: float,
    seen: tuple[str, ...] = (),
    target: Any = None,
    detected: Any = None,
    visible: float = 0.0,
    marker: MarkerView | None = None,
) -> Step:
    found = () if detected is None else (detection(detected),)
    return Step(
        time_s=time_s,
        command="PositionSetpoint",
        marker_visible=visible,
        marker_px=24.0,
        objects_visible=seen,
        diagnostics=Diagnostics(target_m=target, detections=found),
        marker=marker,
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


def nominal(marker: MarkerView, duration_s: float = 10.0) -> tuple[NominalView, ...]:
    view = NominalView(
        time_s=10.0, duration_s=duration_s, place="above", height_m=6.0, marker=marker
    )
    return (view,)


def touchdown(
    distance_m: float, *, on: str = "nothing", time_s: float = 27.0, **changes: Any
) -> Touchdown:
    base = Touchdown(
        time_s=time_s,
        position_m=(distance_m, 0.0, 0.2),
        distance_m=distance_m,
        speed_mps=0.4,
        tilt_rad=0.02,
        on=on,
        stopped_s=time_s + 1.0,
    )
    return dataclasses.replace(base, **changes)


def person_at(times: tuple[float, ...], xs: tuple[float, ...]) -> ObjectRecord:
    """Return a person who is at y = 0 and these x at these times, at rest in between."""
    samples = [(time, x, 0.0, 0.0) for time, x in zip(times, xs, strict=True)]
    return ObjectRecord(
        name="person-1", type="person", track=track(*samples), moves=np.zeros((0, 2))
    )
