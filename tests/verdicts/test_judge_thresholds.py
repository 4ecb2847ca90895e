"""Each threshold of the judge from both sides."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from pytest_garl.landing_system import Diagnostics
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import flight, hit, step


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
    assert judge(subject, Limits(distance_m=1.5)).signature == signature


def test_signature_names_the_nearest_of_two_decoys() -> None:
    decoys = (("decoy-a", 4.0, 5.2), ("decoy-b", 4.0, 4.3))
    subject = flight("landed", (4.0, 4.0, 0.2), steps=(step(5.0, target=(4, 4, 0)),), decoys=decoys)
    assert judge(subject, Limits(distance_m=1.5)).signature.startswith("I:decoy-b:")


@pytest.mark.parametrize(("away_m", "what"), [(1.5, "decoy-a"), (1.501, "phantom")])
def test_signature_names_a_decoy_within_1_5_m_of_the_target(away_m: float, what: str) -> None:
    subject = flight(
        "landed",
        (4.0, 4.0, 0.2),
        steps=(step(5.0, target=(4.0, 4.0, 0.0)),),
        decoys=(("decoy-a", 4.0 + away_m, 4.0),),
    )
    assert judge(subject, Limits(distance_m=1.5)).signature.startswith(f"I:{what}:")


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "off"), (1.501, "I")])
def test_a_target_within_1_5_m_of_the_marker_is_right(away_m: float, kind: str) -> None:
    subject = flight("landed", (3.0, 0.0, 0.2), steps=(step(5.0, target=(away_m, 0.0, 0.0)),))
    assert judge(subject, Limits(distance_m=1.5)).violation_type == kind


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
    verdict = judge(
        flight("not_landed", (0.0, 0.0, 10.0), steps=(*steps, step(29.9))), Limits(distance_m=1.5)
    )
    assert verdict.signature == signature
    assert words in verdict.story


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "late"), (1.501, "II")])
def test_a_detection_within_1_5_m_of_the_marker_counts_as_a_sighting(
    away_m: float, kind: str
) -> None:
    steps = (step(29.9, detected=(away_m, 0.0, 0.0)),)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits(distance_m=1.5))
    assert verdict.violation_type == kind


@pytest.mark.parametrize(("away_m", "kind"), [(1.5, "late"), (1.501, "II")])
def test_targets_count_as_sightings_of_a_system_without_detections(
    away_m: float, kind: str
) -> None:
    steps = (step(29.9, target=(away_m, 0.0, 0.0)),)
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits(distance_m=1.5))
    assert verdict.violation_type == kind
    assert "detected" in verdict.story


def test_a_target_is_no_sighting_of_a_system_with_detections() -> None:
    here = (0.0, 0.0, 0.0)
    steps = (step(5.0, detected=here, target=here), step(29.9, target=here))
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=steps), Limits(distance_m=1.5))
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
    verdict = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=(silent,)), Limits(distance_m=1.5))
    assert verdict.violation_type == kind
    assert words in verdict.story
    assert "detected" not in verdict.story
    earlier = dataclasses.replace(silent, time_s=20.0)
    lost = judge(flight("not_landed", (0.0, 0.0, 10.0), steps=(earlier,)), Limits(distance_m=1.5))
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
    assert judge(subject, Limits(distance_m=1.5)).signature.endswith(f":{sight}")
