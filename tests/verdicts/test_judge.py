from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from pytest_garl.landing_system import Diagnostics
from pytest_garl.simulation.flight import Contact, Crash, Flight, Separation, Step, Track
from pytest_garl.verdicts.judge import closest_call, judge, undecided
from pytest_garl.verdicts.metrics import share_interval, top_k
from pytest_garl.verdicts.serialise import from_dict, to_dict
from pytest_garl.verdicts.verdict import Limits


def step(time_s: float, seen: tuple[str, ...] = (), target: Any = None) -> Step:
    return Step(
        time_s=time_s,
        command="PositionSetpoint",
        marker_visible=0.0,
        marker_px=24.0,
        objects_visible=seen,
        diagnostics=Diagnostics(target_m=target),
    )


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


@pytest.mark.parametrize(
    ("subject", "primary", "signature"),
    [
        (flight("landed", (0.2, 0.0, 0.2)), None, ""),
        (
            flight("landed", (4.1, 4.0, 0.2), steps=(step(5.0, target=(4, 4, 0)),)),
            "distance",
            "I:decoy-marker-3:transit",
        ),
        (
            flight("landed", (3.0, -4.0, 0.2), steps=(step(5.0, target=(3, -4, 0)),)),
            "distance",
            "I:phantom:transit",
        ),
        (
            flight("landed", (3.0, 0.0, 0.2), steps=(step(5.0, target=(0, 0, 0)),)),
            "distance",
            "off:knew-better",
        ),
        (flight("landed", (3.0, 0.0, 0.2)), "distance", "I?:unknown"),
        (
            flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic")),
            "collision",
            "IV:dog:last-metre:unseen",
        ),
        (
            flight(
                "collision",
                (0.0, 0.0, 1.0),
                contacts=hit("dog-1", "dog", "dynamic"),
                steps=(step(29.0, ("dog-1",)),),
            ),
            "collision",
            "IV:dog:last-metre:seen",
        ),
        (
            flight("collision", (3.0, 0.0, 4.0), contacts=hit("tree-3", "tree", "static")),
            "collision",
            "III:tree:descent",
        ),
        (
            flight("collision", (0.0, 0.0, 0.2), contacts=hit("ground", "ground", "ground")),
            "collision",
            "hard:fast",
        ),
        (
            flight("collision", (0.0, 0.0, 0.2), contacts=hit("ground", "ground", "ground", 0.5)),
            "collision",
            "hard:tilted",
        ),
        (flight("not_landed", (0.0, 0.0, 10.0)), "time", "II:never-seen:approach"),
        (
            flight("crashed", (0.0, 0.0, 5.0), crash=CRASH),
            "crash",
            "V:PlannerError@planning_ego.plan",
        ),
        (flight("aborted", (0.0, 0.0, 8.0)), None, ""),
    ],
)
def test_the_first_event_decides(subject: Flight, primary: Any, signature: str) -> None:
    verdict = judge(subject, Limits())
    assert verdict.primary == primary
    assert verdict.signature == signature
    assert verdict.story
    assert from_dict(to_dict(verdict)) == verdict


def test_late_and_aborted_are_no_violation_in_the_papers_sense() -> None:
    late = judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=20))
    assert (late.primary, late.violation_type, late.paper_violation) == ("time", "late", False)
    aborted = judge(flight("aborted", (0.0, 0.0, 8.0)), Limits(abort="violation"))
    assert (aborted.primary, aborted.paper_violation) == ("abort", False)


def test_a_landing_off_and_late_is_one_violation_of_distance() -> None:
    verdict = judge(flight("landed", (5.0, 0.0, 0.2)), Limits(time_s=20))
    assert verdict.primary == "distance"


def test_what_a_collision_leaves_undecided_says_why() -> None:
    subject = flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic"))
    assert undecided(subject) == "collision with dog-1 at 30.0 s"


def test_margins_are_signed() -> None:
    margins = {m.property: m for m in judge(flight("landed", (2.0, 0.0, 0.2)), Limits()).margins}
    assert margins["distance"].value == pytest.approx(-0.5)
    assert margins["time"].value == pytest.approx(90.0)


def test_exact_interval_of_a_share() -> None:
    # Clopper-Pearson for 0 of 10 is [0, 1 - 0.025^(1/10)].
    low, high = share_interval(0, 10)
    assert low == 0
    assert high == pytest.approx(1 - 0.025**0.1)


def test_top_k_counts_flights_up_to_the_kth_violation() -> None:
    good = judge(flight("landed", (0.0, 0.0, 0.2)), Limits())
    bad = judge(flight("landed", (5.0, 0.0, 0.2)), Limits())
    assert top_k([good, bad, good, bad], k=2) == 4
    assert top_k([good, bad], k=2) is None


def gap(body: str, kind: str, body_class: Any, distance_m: float, time_s: float) -> Separation:
    return Separation(
        body=body, kind=kind, body_class=body_class, distance_m=distance_m, time_s=time_s
    )


def test_a_closest_call_is_named_as_the_collision_that_it_nearly_was() -> None:
    near = flight(
        "landed",
        (0.0, 0.0, 0.2),
        steps=(step(29.5, seen=("dog-1",)),),
        separations=(
            gap("ground", "ground", "ground", 0.0, 30.0),
            gap("tree-1", "tree", "static", 2.0, 10.0),
            gap("dog-1", "dog", "dynamic", 0.4, 30.0),
        ),
    )
    assert closest_call(near) == ("IV:dog:last-metre:seen", "dog-1")
    collided = dataclasses.replace(
        near, outcome="collision", contacts=hit("dog-1", "dog", "dynamic")
    )
    assert judge(collided, Limits()).signature == closest_call(near)[0]


def test_what_stays_three_metres_away_is_no_close_call() -> None:
    far = flight(
        "landed", (0.0, 0.0, 0.2), separations=(gap("tree-1", "tree", "static", 3.0, 10.0),)
    )
    assert closest_call(far) == ("", "")
