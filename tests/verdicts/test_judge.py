from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.simulation.flight import Flight
from pytest_garl.verdicts.judge import closest_call, judge, off_marker_m, why_undecided
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import CRASH, flight, gap, hit, step, touch, track


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
        (flight("gave_up", (0.0, 0.0, 8.0)), None, ""),
    ],
)
def test_the_first_event_decides_the_verdict(subject: Flight, primary: Any, signature: str) -> None:
    verdict = judge(subject, Limits(distance_m=1.5))
    assert verdict.primary == primary
    assert verdict.signature == signature
    assert verdict.story


def test_late_and_aborted_flights_are_no_paper_violation() -> None:
    late = judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=20))
    assert (late.primary, late.violation_type, late.paper_violation) == ("time", "late", False)
    aborted = judge(flight("gave_up", (0.0, 0.0, 8.0)), Limits(abort="violation"))
    assert (aborted.primary, aborted.paper_violation) == ("abort", False)


def test_a_late_landing_off_the_marker_violates_the_distance_alone() -> None:
    verdict = judge(flight("landed", (5.0, 0.0, 0.2)), Limits(time_s=20))
    assert verdict.primary == "distance"


def test_why_undecided_names_the_collision() -> None:
    subject = flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic"))
    assert why_undecided(subject) == "collision with dog-1 at 30.0 s"


def test_margins_are_signed() -> None:
    margins = {
        m.property: m
        for m in judge(flight("landed", (2.0, 0.0, 0.2)), Limits(distance_m=1.5)).margins
    }
    assert margins["distance"].value == pytest.approx(-0.5)
    assert margins["time"].value == pytest.approx(90.0)


def test_closest_call_has_the_signature_of_the_near_collision() -> None:
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
    assert judge(collided, Limits(distance_m=1.5)).signature == closest_call(near)[0]


def test_a_body_three_metres_away_is_no_close_call() -> None:
    far = flight(
        "landed", (0.0, 0.0, 0.2), separations=(gap("tree-1", "tree", "static", 3.0, 10.0),)
    )
    assert closest_call(far) == ("", "")


DESCENT_AND_CLIMB = (
    (0.0, 0.0, -10.0, 8.0),
    (10.0, 5.0, 0.0, 0.25),
    (10.1, 5.0, 0.0, 0.2),
    (14.0, 5.0, 0.0, 5.0),
)


@pytest.mark.parametrize(
    ("target", "signature", "words"),
    [
        (None, "I?:unknown", "it does not say on what"),
        ((0.0, 0.0, 0.0), "off:knew-better", "though its target was right"),
        ((5.0, 0.0, 0.0), "I:phantom:last-metre", "on something that it took for the marker"),
        ((4.0, 4.0, 0.0), "I:decoy-marker-3:last-metre", "on decoy-marker-3"),
    ],
)
def test_a_touchdown_off_the_marker_before_an_abort_is_judged_as_a_landing(
    target: Any, signature: str, words: str
) -> None:
    subject = flight(
        "gave_up",
        (5.0, 0.0, 5.0),
        uav=track(*DESCENT_AND_CLIMB),
        contacts=touch(10.0),
        # What it takes for the marker after the touch is not what it came down on.
        steps=(step(10.0, target=target), step(13.0, target=(-9.0, 0.0, 0.0))),
    )
    verdict = judge(subject, Limits(distance_m=1.5))
    assert (verdict.primary, verdict.signature) == ("distance", signature)
    assert verdict.story.startswith("Touched the ground 5.0 m off the marker before it gave up")
    assert words in verdict.story
    margins = {each.property: each for each in verdict.margins}
    assert (margins["distance"].value, margins["distance"].decided) == (-3.5, True)
    assert not margins["time"].decided
    assert off_marker_m(subject, Limits(distance_m=1.5)) == 5.0
    assert not verdict.paper_violation


def test_a_touchdown_within_the_limit_before_an_abort_is_no_violation() -> None:
    subject = flight(
        "gave_up", (5.0, 0.0, 5.0), uav=track(*DESCENT_AND_CLIMB), contacts=touch(10.0)
    )
    assert judge(subject, Limits(distance_m=5.0)).primary is None
    assert off_marker_m(subject, Limits(distance_m=5.0)) is None
    assert judge(subject, Limits(distance_m=4.99)).primary == "distance"


def test_sliding_off_the_marker_before_an_abort_violates_and_flying_off_does_not() -> None:
    touched = ((0.0, 0.0, 0.0, 8.0), (10.0, 0.0, 0.0, 0.22), (10.1, 0.5, 0.0, 0.2))
    slid = track(*touched, (12.0, 3.0, 0.0, 0.21), (14.0, 3.0, 0.0, 5.0))
    flew = track(*touched, (12.0, 3.0, 0.0, 0.3), (14.0, 3.0, 0.0, 5.0))
    subject = flight("gave_up", (3.0, 0.0, 5.0), uav=slid, contacts=touch(10.05))
    verdict = judge(subject, Limits(distance_m=1.5))
    assert verdict.primary == "distance"
    assert "Touched the ground 3.0 m off" in verdict.story
    assert judge(dataclasses.replace(subject, uav=flew), Limits(distance_m=1.5)).primary is None


def test_an_abort_in_the_air_leaves_the_distance_undecided() -> None:
    subject = flight("gave_up", (5.0, 0.0, 5.0))
    margins = {each.property: each for each in judge(subject, Limits(distance_m=1.5)).margins}
    assert not margins["distance"].decided
    assert margins["distance"].reason == "aborted at 30.0 s"
    assert off_marker_m(subject, Limits(distance_m=1.5)) is None
