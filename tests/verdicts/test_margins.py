"""Margins of all properties: finite in every flight, and never larger in a worse one."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.flight.flight import Flight, Outcome
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits, MarginName
from tests.verdicts.flights import CLEAR, CRASH, flight, gap, hit, step, touchdown

OUTCOMES: tuple[Any, ...] = get_args(Outcome)
SECONDS = np.linspace(0.0, 60.0, 121)


def _flown(
    outcome: Any = "collision",
    *,
    off_m: float = 0.2,
    lowest_m: float = 1.0,
    sink_mps: float = 0.4,
    tilt_rad: float = 0.05,
    gap_m: float = 2.0,
    undetected_s: float = 1.0,
    target_m: float = 0.1,
    slid_m: float = 0.0,
    end_s: float = 60.0,
) -> Flight:
    """Return a flight that crosses at 10 m to ``off_m`` beside the marker and comes down."""
    times = SECONDS[end_s >= SECONDS]
    x = off_m + np.maximum(0.0, 20.0 - 20.0 * times / 15.0)
    z = np.interp(times, [0.0, 5.0, 20.0, 60.0], [0.2, 10.0, 10.0, lowest_m])
    places = np.column_stack([x, np.zeros_like(x), z])
    velocity = np.column_stack([np.zeros_like(x), np.zeros_like(x), np.full_like(x, -sink_mps)])
    attitude = np.tile([math.sin(tilt_rad / 2), 0.0, 0.0, math.cos(tilt_rad / 2)], (len(x), 1))
    base = flight(outcome, (off_m, 0.0, float(z[-1])), elapsed_s=float(times[-1]))
    steps = [step(20.0, marker=CLEAR, detected=(0.0, 0.0, 0.0), target=(0.0, 0.0, 0.0))]
    steps += [
        step(21.0 + 0.5 * index, marker=CLEAR) for index in range(1 + round(2 * undetected_s))
    ]
    steps.append(step(59.0, target=(off_m + target_m, 0.0, 0.0)))
    landed = outcome in ("landed", "slid")
    return dataclasses.replace(
        base,
        uav=dataclasses.replace(
            base.uav, time_s=times, position_m=places, attitude=attitude, velocity_mps=velocity
        ),
        steps=tuple(steps),
        separations=(gap("dog-1", "dog", "dynamic", gap_m, 30.0),),
        contacts=hit("tree-1", "tree", "static") if outcome == "collision" else (),
        crash=CRASH if outcome == "crashed" else None,
        touchdown=touchdown(off_m, slid_m=slid_m, speed_mps=sink_mps, tilt_rad=tilt_rad)
        if landed
        else None,
    )


def _margins(subject: Flight) -> dict[str, float]:
    return {each.property: each.value for each in judge(subject, Limits()).margins}


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_every_flight_has_every_margin(outcome: Any) -> None:
    found = judge(_flown(outcome), Limits()).margins
    assert len({each.property for each in found}) == len(found)
    assert {each.property for each in found} == set(get_args(MarginName)) - {"abort", "own"}
    assert all(math.isfinite(each.value) for each in found)
    assert all(each.decided or each.reason for each in found)


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_distance_and_time_are_decided_if_the_uav_came_down_or_gave_up(outcome: Any) -> None:
    decided = {each.property: each.decided for each in judge(_flown(outcome), Limits()).margins}
    expected = outcome in ("landed", "slid", "gave_up", "not_landed")
    assert (decided["distance"], decided["time"]) == (expected, expected)


WORSE = {
    "off_m": ("distance", st.floats(0.0, 8.0)),
    "sink_mps": ("touchdown_speed", st.floats(0.0, 4.0)),
    "tilt_rad": ("touchdown_tilt", st.floats(0.0, 1.0)),
    "undetected_s": ("dropout", st.integers(0, 12)),
    "target_m": ("tracking", st.floats(0.0, 3.0)),
    "slid_m": ("slide", st.floats(0.0, 9.0)),
}


@pytest.mark.parametrize("what", WORSE)
@pytest.mark.parametrize("outcome", ["landed", "slid", "gave_up", "not_landed", "collision"])
@settings(max_examples=40)
@given(data=st.data())
def test_a_worse_flight_has_no_larger_margin(outcome: Any, what: str, data: Any) -> None:
    name, values = WORSE[what]
    better, worse = sorted((data.draw(values), data.draw(values)))
    before = _margins(_flown(outcome, **{what: better}))
    after = _margins(_flown(outcome, **{what: worse}))
    assert after[name] <= before[name] + 1e-9


@settings(max_examples=40)
@given(a=st.floats(0.0, 6.0), b=st.floats(0.0, 6.0))
def test_a_nearer_body_has_no_larger_margin(a: float, b: float) -> None:
    near, far = sorted((a, b))
    for outcome in ("landed", "gave_up"):
        first, second = (_margins(_flown(outcome, gap_m=each)) for each in (far, near))
        assert second["moving"] <= first["moving"]
        assert second["collision"] <= first["collision"]


@settings(max_examples=40)
@given(a=st.integers(60, 120), b=st.integers(60, 120), landed=st.booleans())
def test_a_later_flight_has_no_larger_margin(a: int, b: int, landed: bool) -> None:
    outcome = "landed" if landed else "gave_up"
    early, late = sorted((a, b))
    values = [
        _margins(
            dataclasses.replace(
                _flown(outcome),
                elapsed_s=end,
                touchdown=touchdown(0.2, time_s=end - 3.0) if landed else None,
            )
        )["time"]
        for end in (float(early), float(late))
    ]
    assert values[1] <= values[0]


def test_a_small_change_of_the_path_changes_the_estimates_a_little() -> None:
    for lowest in np.arange(0.3, 9.0, 0.05):
        first, second = (_margins(_flown(lowest_m=float(each))) for each in (lowest, lowest + 0.01))
        for name in ("distance", "time", "decoy"):
            assert abs(first[name] - second[name]) < 0.05


def test_a_flight_that_stays_high_has_a_smaller_margin_of_distance() -> None:
    low, high = _margins(_flown(lowest_m=1.0)), _margins(_flown(lowest_m=8.0))
    assert high["distance"] < low["distance"]


def test_a_flight_nearer_to_a_decoy_than_to_the_marker_has_a_negative_margin() -> None:
    decoys = (("pad", 4.0, 0.0),)
    on_it = dataclasses.replace(_flown(off_m=4.0), decoys=decoys)
    beside = dataclasses.replace(_flown(off_m=0.0, target_m=0.0), decoys=decoys)
    assert _margins(on_it)["decoy"] < 0 < _margins(beside)["decoy"]


def test_an_excused_flight_has_time_left() -> None:
    early = dataclasses.replace(_flown("gave_up"), steps=())
    assert _margins(early)["time"] == 0.0
    allowed = judge(early, Limits(abort="ok")).margin("time")
    assert allowed is not None
    assert allowed.value == 60.0
