from __future__ import annotations

import dataclasses
from typing import Any, get_args

import numpy as np
import pytest

from pytest_garl.cases.case import Prevention
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Diagnostics
from pytest_garl.reports.html.hints import hints_of
from pytest_garl.reports.html.sightings_text import sighting_sentences
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import Finding, Verdict, ViolationType
from tests.support.recorded_flights import hit_by_dog, recorded, seen
from tests.support.results import flight_result


def verdict(kind: Any, signature: str = "") -> Verdict:
    return flight_result(signature or f"{kind}:x", violation_type=kind).verdict


def collided(frames: range) -> Flight:
    steps = tuple(
        dataclasses.replace(each, objects_visible=("dog-1",) if index in frames else ())
        for index, each in enumerate(seen(range(20, 80)))
    )
    return recorded(steps=steps, outcome="collision", contacts=(hit_by_dog(8.0),), end_s=8.0)


@pytest.mark.parametrize(
    "kind", [each for each in get_args(ViolationType) if each not in ("own", "V")]
)
def test_every_type_has_a_hint(kind: str) -> None:
    flight = collided(range(60, 80)) if kind == "IV" else recorded(steps=seen(range(20, 60)))
    hints = hints_of(Evidence(flight), verdict(kind))
    assert hints
    assert all(hint.endswith(".") for hint in hints)
    assert isinstance(hints_of(None, verdict(kind)), tuple)


def test_a_marker_that_was_readable_and_not_reported_points_to_the_detector() -> None:
    missed = recorded(steps=seen(range(20, 60), reported=range(50, 55)), given_up_s=9.0)
    assert "look at the detector" in hints_of(Evidence(missed), verdict("II"))[0]
    assert "reported it in 5 of these 40 frames" in " ".join(sighting_sentences(Evidence(missed)))


def test_a_marker_that_was_reported_points_to_the_decision() -> None:
    told = recorded(steps=seen(range(20, 60), reported=range(20, 60)), given_up_s=9.0)
    assert "it is not the detector" in hints_of(Evidence(told), verdict("II"))[0]
    assert "at 9.0 s" in hints_of(Evidence(told), verdict("II"))[0]


def test_a_target_is_no_sighting() -> None:
    steps = tuple(
        dataclasses.replace(each, diagnostics=Diagnostics(target_m=(0.0, 0.0, 0.0)))
        for each in seen(range(20, 60))
    )
    (hint,) = hints_of(Evidence(recorded(steps=steps, given_up_s=9.0)), verdict("II"))
    assert "it is not the detector" not in hint
    assert "reports no detections" in hint


def test_a_system_that_reports_nothing_is_not_accused() -> None:
    places = np.tile([5.0, 0.0, 9.0], (241, 1))
    places[:24, 2] = 0.1
    # Two seconds above the marker, at the lowest 3.9 m up.
    places[96:144] = (0.5, 0.0, 4.1)
    flight = recorded(steps=seen(range(20, 60)), given_up_s=9.0, places=places)
    first, patch = hints_of(Evidence(flight), verdict("II"))
    assert "detector" not in first
    assert "nothing tells whether it saw the marker" in first
    assert "within 1 m of the marker, seen from above, for 2.0 s, first at 4.0 s" in first
    assert "there it was 3.9 m up at the lowest, at 4.0 s" in first
    assert "It never commanded a landing; it gave up at 9.0 s." in first
    assert "PositionSetpoint(..., diagnostics=Diagnostics(target_m=(x, y, 0.0)))" in patch


def test_a_system_that_reports_nothing_and_flies_elsewhere_is_told_how_near_it_came() -> None:
    far = np.tile([5.0, 0.0, 9.0], (241, 1))
    (first, _) = hints_of(Evidence(recorded(steps=seen(range(20, 60)), places=far)), verdict("II"))
    assert "never nearer than 5.0 m to the marker" in first


def test_a_landing_elsewhere_without_a_target_blames_neither_detector_nor_control() -> None:
    landed = Evidence(recorded(steps=seen(range(20, 60)), outcome="landed"))
    (hint,) = hints_of(landed, verdict("I"))
    assert "cannot tell a wrong target from a wrong way there" in hint
    assert "Diagnostics(target_m=(x, y, 0.0))" in hint


def test_a_marker_that_could_never_be_read_points_to_the_search() -> None:
    assert "searches" in hints_of(Evidence(recorded(steps=seen(()))), verdict("II"))[0]
    (sentence, *_) = sighting_sentences(Evidence(recorded(steps=seen(()))))
    assert sentence.startswith("The marker could not be read in any of 100 frames")


@pytest.mark.parametrize(
    ("signature", "words"),
    [
        ("late:standing", "how the system notices a touchdown"),
        ("late:never-gave-up", "look at when the system gives up"),
        ("late:landed:descent", "where the UAV was, and for how long"),
    ],
)
def test_a_late_flight_is_told_by_what_took_its_time(signature: str, words: str) -> None:
    assert words in hints_of(Evidence(recorded(steps=seen(()))), verdict("late", signature))[0]


def test_a_uav_that_stood_on_the_ground_is_told_to_stop_its_motors() -> None:
    stood = Prevention(answer="preventable", inevitable_s=0.5, escape="motors off")
    assert (
        "when it stops the motors"
        in hints_of(Evidence(collided(range(0))), verdict("IV"), stood)[0]
    )


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("preventable", "An escape existed after the camera could show the body"),
        ("sensor-limited", "a wider view"),
        ("unpreventable", "not about the code"),
        ("not asked", "2.0 s before the contact"),
    ],
)
def test_a_collision_says_what_could_have_prevented_it(answer: Any, words: str) -> None:
    prevention = Prevention(answer=answer, inevitable_s=0.5, observed_s=2.0)
    assert words in hints_of(Evidence(collided(range(60, 80))), verdict("IV"), prevention)[0]


def test_the_sentences_say_when_the_body_was_first_in_view() -> None:
    told = " ".join(sighting_sentences(Evidence(collided(range(60, 80)))))
    assert "showed dog-1 in 20 frames, first at 6.0 s, which is 2.0 s before the contact" in told
    assert "the last 5.3 s before the contact count: they have 20 of these frames, 0 of" in told
    early = " ".join(sighting_sentences(Evidence(collided(range(20)))))
    assert "showed dog-1 in 20 frames" in early
    assert "count: they have none of these frames." in early
    unseen = " ".join(sighting_sentences(Evidence(collided(range(0)))))
    assert "never showed dog-1 before the contact at 8.0 s" in unseen


def test_a_landing_beside_the_marker_is_told_by_its_target() -> None:
    def landed(target: tuple[float, float, float]) -> str:
        steps = tuple(
            dataclasses.replace(each, diagnostics=Diagnostics(target_m=target))
            for each in seen(range(20, 60))
        )
        beside = np.tile([4.0, 0.0, 0.2], (241, 1))
        flight = recorded(steps=steps, outcome="landed", places=beside)
        return hints_of(Evidence(flight), verdict("I"))[0]

    assert "look at the detector" in landed((4.0, 0.0, 0.0))
    assert "look at the control" in landed((0.0, 0.0, 0.0))


def test_a_decoy_points_to_the_choice_of_the_target_and_says_when_it_left_the_marker() -> None:
    steps = tuple(
        dataclasses.replace(
            each,
            diagnostics=Diagnostics(target_m=(0.0 if each.time_s < 4.05 else 6.0, 0.0, 0.0)),
        )
        for each in seen(range(20, 60))
    )
    decoy = "I:decoy-same-id-without-margin"
    (hint,) = hints_of(Evidence(recorded(steps=steps)), verdict("I", f"{decoy}:seen"))
    assert hint.startswith("It came down on a decoy, same-id-without-margin: ")
    assert "how the system chooses among what it may take for the marker" in hint
    assert hint.endswith("Its target was last at the marker at 4.0 s.")
    finding = Finding(signature=decoy, margin=-1.0, unit="m", time_s=5.0, story="A.")
    tree = dataclasses.replace(verdict("III", "III:tree:descent"), findings=(finding,))
    first, second = hints_of(Evidence(recorded(steps=steps)), tree)
    assert first == hint.replace("It came down on", "It was coming down to")
    assert second == hints_of(None, verdict("III"))[0]


def test_a_decoy_under_a_system_that_reports_no_target_is_no_choice_of_it() -> None:
    signature = "I:decoy-helipad-h:seen"
    (hint,) = hints_of(Evidence(recorded(steps=seen(range(20, 60)))), verdict("I", signature))
    assert "nothing tells whether it took the decoy for the marker" in hint
    assert "detects" not in hint
    assert "Diagnostics(target_m=(x, y, 0.0))" in hint


@pytest.mark.parametrize(
    ("story", "words"),
    [
        ("The landing system raised: ValueError: no.", "traceback below names the line"),
        ("The landing system returned nonsense: x.", "what the method returned"),
        ("The landing system died: signal-11: it ended.", "without a Python exception"),
        ("The landing system hung: Timeout: step took more than 10 s.", "did not return in time"),
    ],
)
def test_a_hint_of_a_failed_system_names_only_what_stands_there(story: str, words: str) -> None:
    result = flight_result("V:x@y", violation_type="V", story=f"{story} At 1.0 s the UAV was up.")
    (hint,) = hints_of(None, result.verdict)
    assert words in hint
    assert ("traceback" in hint) is ("raised" in story)


def test_few_targets_do_not_accuse_the_detector() -> None:
    steps = tuple(
        dataclasses.replace(each, diagnostics=Diagnostics(target_m=(0.0, 0.0, 0.0)))
        if each.time_s < 2.95
        else each
        for each in seen(range(20, 60))
    )
    (hint,) = hints_of(Evidence(recorded(steps=steps, given_up_s=9.0)), verdict("II"))
    assert "had a target at it in 10 of them. It reports no detections" in hint
    assert "look at the detector" not in hint
