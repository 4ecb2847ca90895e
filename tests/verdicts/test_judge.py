from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.simulation.flight import Contact, Crash, Flight, Separation, Step, Track
from pytest_garl.verdicts.judge import closest_call, judge, off_marker_m, why_undecided
from pytest_garl.verdicts.verdict import Limits


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


def flown(*samples: tuple[float, float, float, float]) -> Track:
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
def test_the_first_event_decides_the_verdict(subject: Flight, primary: Any, signature: str) -> None:
    verdict = judge(subject, Limits())
    assert verdict.primary == primary
    assert verdict.signature == signature
    assert verdict.story


def test_late_and_aborted_flights_are_no_paper_violation() -> None:
    late = judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=20))
    assert (late.primary, late.violation_type, late.paper_violation) == ("time", "late", False)
    aborted = judge(flight("aborted", (0.0, 0.0, 8.0)), Limits(abort="violation"))
    assert (aborted.primary, aborted.paper_violation) == ("abort", False)


def test_a_late_landing_off_the_marker_violates_the_distance_alone() -> None:
    verdict = judge(flight("landed", (5.0, 0.0, 0.2)), Limits(time_s=20))
    assert verdict.primary == "distance"


def test_why_undecided_names_the_collision() -> None:
    subject = flight("collision", (0.0, 0.0, 1.0), contacts=hit("dog-1", "dog", "dynamic"))
    assert why_undecided(subject) == "collision with dog-1 at 30.0 s"


def test_margins_are_signed() -> None:
    margins = {m.property: m for m in judge(flight("landed", (2.0, 0.0, 0.2)), Limits()).margins}
    assert margins["distance"].value == pytest.approx(-0.5)
    assert margins["time"].value == pytest.approx(90.0)


def gap(body: str, kind: str, body_class: Any, distance_m: float, time_s: float) -> Separation:
    return Separation(
        body=body, kind=kind, body_class=body_class, distance_m=distance_m, time_s=time_s
    )


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
    assert judge(collided, Limits()).signature == closest_call(near)[0]


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
        "aborted",
        (5.0, 0.0, 5.0),
        uav=flown(*DESCENT_AND_CLIMB),
        contacts=touch(10.0),
        # What it takes for the marker after the touch is not what it came down on.
        steps=(step(10.0, target=target), step(13.0, target=(-9.0, 0.0, 0.0))),
    )
    verdict = judge(subject, Limits())
    assert (verdict.primary, verdict.signature) == ("distance", signature)
    assert verdict.story.startswith("Touched the ground 5.0 m off the marker before it gave up")
    assert words in verdict.story
    margins = {each.property: each for each in verdict.margins}
    assert (margins["distance"].value, margins["distance"].decided) == (-3.5, True)
    assert not margins["time"].decided
    assert off_marker_m(subject, Limits()) == 5.0
    assert not verdict.paper_violation


def test_a_touchdown_within_the_limit_before_an_abort_is_no_violation() -> None:
    subject = flight(
        "aborted", (5.0, 0.0, 5.0), uav=flown(*DESCENT_AND_CLIMB), contacts=touch(10.0)
    )
    assert judge(subject, Limits(distance_m=5.0)).primary is None
    assert off_marker_m(subject, Limits(distance_m=5.0)) is None
    assert judge(subject, Limits(distance_m=4.99)).primary == "distance"


def test_sliding_off_the_marker_before_an_abort_violates_and_flying_off_does_not() -> None:
    touched = ((0.0, 0.0, 0.0, 8.0), (10.0, 0.0, 0.0, 0.22), (10.1, 0.5, 0.0, 0.2))
    slid = flown(*touched, (12.0, 3.0, 0.0, 0.21), (14.0, 3.0, 0.0, 5.0))
    flew = flown(*touched, (12.0, 3.0, 0.0, 0.3), (14.0, 3.0, 0.0, 5.0))
    subject = flight("aborted", (3.0, 0.0, 5.0), uav=slid, contacts=touch(10.05))
    verdict = judge(subject, Limits())
    assert verdict.primary == "distance"
    assert "Touched the ground 3.0 m off" in verdict.story
    assert judge(dataclasses.replace(subject, uav=flew), Limits()).primary is None


def test_an_abort_in_the_air_leaves_the_distance_undecided() -> None:
    subject = flight("aborted", (5.0, 0.0, 5.0))
    margins = {each.property: each for each in judge(subject, Limits()).margins}
    assert not margins["distance"].decided
    assert margins["distance"].reason == "aborted at 30.0 s"
    assert off_marker_m(subject, Limits()) is None


# Each threshold from both sides.


@pytest.mark.parametrize(("distance_m", "violated"), [(1.5, False), (1.501, True)])
def test_paper_violation_begins_beyond_1_5_m(distance_m: float, violated: bool) -> None:
    verdict = judge(flight("landed", (distance_m, 0.0, 0.2)), Limits(distance_m=4.0))
    assert verdict.paper_violation is violated
    assert verdict.primary is None


@pytest.mark.parametrize(("limit_m", "primary"), [(3.0, None), (2.999, "distance")])
def test_a_landing_at_the_limit_of_distance_is_no_violation(limit_m: float, primary: Any) -> None:
    verdict = judge(flight("landed", (3.0, 0.0, 0.2)), Limits(distance_m=limit_m))
    assert verdict.primary == primary


@pytest.mark.parametrize(("limit_s", "primary"), [(30.0, None), (29.999, "time")])
def test_a_landing_at_the_limit_of_time_is_no_violation(limit_s: float, primary: Any) -> None:
    assert judge(flight("landed", (0.0, 0.0, 0.2)), Limits(time_s=limit_s)).primary == primary


@pytest.mark.parametrize(("tilt_deg", "signature"), [(20.0, "hard:fast"), (20.1, "hard:tilted")])
def test_a_touchdown_beyond_twenty_degrees_is_tilted(tilt_deg: float, signature: str) -> None:
    contacts = hit("ground", "ground", "ground", math.radians(tilt_deg))
    subject = flight("collision", (0.0, 0.0, 0.2), contacts=contacts)
    assert judge(subject, Limits()).signature == signature


def test_signature_names_the_nearest_of_two_decoys() -> None:
    decoys = (("decoy-a", 4.0, 5.2), ("decoy-b", 4.0, 4.3))
    subject = flight("landed", (4.0, 4.0, 0.2), steps=(step(5.0, target=(4, 4, 0)),), decoys=decoys)
    assert judge(subject, Limits()).signature.startswith("I:decoy-b:")


@pytest.mark.parametrize(("away_m", "what"), [(1.5, "decoy-a"), (1.501, "phantom")])
def test_signature_names_a_decoy_within_1_5_m_of_the_target(away_m: float, what: str) -> None:
    subject = flight(
        "landed",
        (4.0, 4.0, 0.2),
        steps=(step(5.0, target=(4.0, 4.0, 0.0)),),
        decoys=(("decoy-a", 4.0 + away_m, 4.0),),
    )
    assert judge(subject, Limits()).signature.startswith(f"I:{what}:")


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "off"), (1.501, "I")])
def test_a_target_within_1_5_m_of_the_marker_is_right(away_m: float, kind: str) -> None:
    subject = flight("landed", (3.0, 0.0, 0.2), steps=(step(5.0, target=(away_m, 0.0, 0.0)),))
    assert judge(subject, Limits()).violation_type == kind


@pytest.mark.parametrize(
    ("last_s", "signature", "words"),
    [
        (27.0, "late:not-landed:approach", "although the marker was detected to the end"),
        (26.9, "II:lost:approach", "the marker was last detected at 26.9 s"),
    ],
)
def test_a_marker_not_detected_for_three_seconds_is_lost(
    last_s: float, signature: str, words: str
) -> None:
    steps = (step(5.0, detected=(0.0, 0.0, 0.0)), step(last_s, detected=(0.0, 0.0, 0.0)))
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=(*steps, step(29.9))), Limits())
    assert verdict.signature == signature
    assert words in verdict.story


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "late"), (1.501, "II")])
def test_a_detection_within_1_5_m_of_the_marker_counts_as_a_sighting(
    away_m: float, kind: str
) -> None:
    steps = (step(29.9, detected=(away_m, 0.0, 0.0)),)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits())
    assert verdict.violation_type == kind


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "late"), (1.501, "II")])
def test_targets_count_as_sightings_of_a_system_without_detections(
    away_m: float, kind: str
) -> None:
    steps = (step(29.9, target=(away_m, 0.0, 0.0)),)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits())
    assert verdict.violation_type == kind
    assert "detected" in verdict.story


def test_a_target_is_no_sighting_of_a_system_with_detections() -> None:
    here = (0.0, 0.0, 0.0)
    steps = (step(5.0, detected=here, target=here), step(29.9, target=here))
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits())
    assert verdict.signature == "II:lost:approach"


@pytest.mark.parametrize("diagnostics", [None, Diagnostics(phase="hover")])
@pytest.mark.parametrize(
    ("visible", "kind", "words"),
    [
        (0.51, "late", "although the marker was in view to the end"),
        (0.5, "II", "the marker was never in view"),
    ],
)
def test_without_diagnostics_the_marker_in_view_counts_as_a_sighting(
    diagnostics: Any, visible: float, kind: str, words: str
) -> None:
    silent = dataclasses.replace(step(29.9, visible=visible), diagnostics=diagnostics)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=(silent,)), Limits())
    assert verdict.violation_type == kind
    assert words in verdict.story
    assert "detected" not in verdict.story
    earlier = dataclasses.replace(silent, time_s=20.0)
    lost = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=(earlier,)), Limits())
    assert lost.violation_type == "II"
    assert "detected" not in lost.story


@pytest.mark.parametrize(("time_s", "sight"), [(28.0, "seen"), (27.9, "unseen"), (30.1, "unseen")])
def test_an_object_in_view_up_to_two_seconds_before_was_seen(time_s: float, sight: str) -> None:
    subject = flight(
        "collision",
        (0.0, 0.0, 1.0),
        contacts=hit("dog-1", "dog", "dynamic"),
        steps=(step(time_s, ("dog-1",)),),
    )
    assert judge(subject, Limits()).signature.endswith(f":{sight}")
