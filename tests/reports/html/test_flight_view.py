from __future__ import annotations

import dataclasses
import json

import numpy as np

from pytest_garl.airframe import Rangefinder
from pytest_garl.flight.flight import Flight, ObjectRecord, Step, Track
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M
from pytest_garl.landing_system import Diagnostics
from pytest_garl.reports.html.flight_view import (
    MOST_PHASES,
    MOST_SAMPLES,
    UAV_RADIUS_M,
    flight_data,
    gap_m,
    phases,
    strips,
)
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.verdicts.evidence import Evidence
from tests.support.recorded_flights import recorded, seen
from tests.support.videos import TARGET, Video


def standing(flight: Flight, x: float, kind: str = "person") -> ObjectRecord:
    count = len(flight.uav.time_s)
    track = Track(
        time_s=flight.uav.time_s,
        position_m=np.tile([x, 0.0, 0.0], (count, 1)),
        attitude=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        velocity_mps=np.zeros((count, 3)),
    )
    return ObjectRecord(name=f"{kind}-1", type=kind, track=track, moves=np.zeros((0, 2)))


def test_data_are_json_and_of_one_length() -> None:
    flight = recorded(steps=seen(range(20, 60), reported=range(25, 60)))
    data = flight_data(Evidence(flight), ())
    json.dumps(data, allow_nan=False)
    count = len(data["t"])
    assert data["t"][-1] == 10.0
    lines = [*data["metres"], *data["percent"]]
    assert {len(line["values"]) for line in lines} == {count}
    assert {len(data["uav"][axis]) for axis in "xyz"} == {count}


def test_the_readings_of_a_rangefinder_are_a_line_with_gaps() -> None:
    without = recorded(steps=seen(range(20, 60)))
    assert "laser" not in {line["kind"] for line in flight_data(Evidence(without), ())["metres"]}
    steps = tuple(
        dataclasses.replace(step, rangefinder_m=5.5 if step.time_s < 4.0 else None)
        for step in without.steps
    )
    flight = dataclasses.replace(without, steps=steps, rangefinder=Rangefinder(most_m=6.0))
    data = flight_data(Evidence(flight), ())
    (line,) = (line for line in data["metres"] if line["kind"] == "laser")
    shown = dict(zip(data["t"], line["values"], strict=True))
    assert (shown[2.0], shown[5.0]) == (5.5, None)


def test_a_long_flight_is_thinned_and_keeps_its_end() -> None:
    places = np.tile([0.0, 0.0, 9.0], (24 * 300, 1))
    data = flight_data(Evidence(recorded(steps=(), places=places, end_s=300.0)), ())
    assert len(data["t"]) <= MOST_SAMPLES + 1
    assert data["t"][-1] == round((len(places) - 1) / 24, 2)


def test_the_gap_is_that_between_cylinders() -> None:
    flight = recorded(steps=(), places=np.tile([0.0, 0.0, 1.0], (10, 1)))
    far = dataclasses.replace(flight, objects=(standing(flight, 5.0),))
    assert np.allclose(gap_m(far), 5.0 - UAV_RADIUS_M - OBJECT_TYPES["person"].radius_m)
    above = recorded(steps=(), places=np.tile([0.0, 0.0, 6.0], (10, 1)))
    below = dataclasses.replace(above, objects=(standing(above, 0.0),))
    assert np.allclose(gap_m(below), 6.0 - BODY_ABOVE_FEET_M - OBJECT_TYPES["person"].height_m)


def test_an_object_of_an_unknown_type_has_a_gap_too() -> None:
    flight = recorded(steps=(), places=np.tile([0.0, 0.0, 1.0], (10, 1)))
    strange = dataclasses.replace(flight, objects=(standing(flight, 5.0, "robot"),))
    assert (gap_m(strange) > 3).all()
    json.dumps(flight_data(Evidence(strange), ()), allow_nan=False)


def test_strips_are_the_spans_in_which_something_held() -> None:
    steps = seen([*range(10, 20), *range(40, 50)], reported=range(15, 20))
    readable, reported = strips(Evidence(recorded(steps=steps)))
    assert readable.spans == ((1.0, 2.0), (4.0, 5.0))
    assert reported.spans == ((1.5, 2.0),)


def test_a_report_of_another_place_is_a_strip_of_its_own() -> None:
    steps = seen(range(10, 20), reported=range(10, 20), place=(5.0, 5.0, 0.0))
    names = {each.name: each.spans for each in strips(Evidence(recorded(steps=steps)))}
    assert names["system reports it"] == ()
    assert names["system reports another place"] == ((1.0, 2.0),)


def with_phase(step: Step, phase: str) -> Step:
    return dataclasses.replace(step, diagnostics=Diagnostics(phase=phase))


def test_phases_are_spans_and_never_too_many() -> None:
    steps = seen((), count=40)
    named = [with_phase(step, "descend" if step.time_s >= 2 else "search") for step in steps]
    assert phases(named, 4.0) == [(0.0, 2.0, "search"), (2.0, 4.0, "descend")]
    restless = [
        with_phase(step, f"phase {index}") for index, step in enumerate(seen((), count=500))
    ]
    assert len(phases(restless, 50.0)) == MOST_PHASES


def test_target_and_plan_of_a_real_flight_are_shown(video: Video) -> None:
    data = flight_data(Evidence(video.flight), ())
    ((_, x, y), *_) = data["targets"]
    # The system reports it in its own frame, in which the estimated position errs.
    assert np.hypot(x - TARGET[0], y - TARGET[1]) < 0.5
    assert data["plans"]
    assert data["phases"][0][2] == "hover"
    assert {item["type"] for item in data["objects"]} <= {"person", "dog", "bird", "child"}
