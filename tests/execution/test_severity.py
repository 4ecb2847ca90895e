from __future__ import annotations

import dataclasses
import random

import pytest

from pytest_garl.execution.result import parse_result
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from tests.support.results import flight_result

PERSON = Severity(about="body", grade="careless", type="person", objects=1, speed_mps=1.4)
DOG = Severity(
    about="body", grade="chasing", type="dog", objects=3, interference_s=3.5, speed_mps=6.1
)
FOG = Severity(
    about="conditions",
    conditions=("fog",),
    values=("visibility 11 m",),
    largest="visibility 11 m",
    largest_share=0.9,
)

CAMERA = Severity(
    about="conditions",
    conditions=("camera", "person-1"),
    values=("dirt 15 %", ""),
    largest="dirt 15 %",
    largest_share=0.18,
)


@pytest.mark.parametrize(
    ("severity", "text"),
    [
        (PERSON, "a careless person at 1.4 m/s"),
        (DOG, "a chasing dog at 6.1 m/s for 3.5 s, 2 others there"),
        (dataclasses.replace(PERSON, objects=2), "a careless person at 1.4 m/s, 1 other there"),
        (dataclasses.replace(PERSON, grade=""), "a person at 1.4 m/s"),
        (FOG, "fog alone, visibility 11 m"),
        (
            dataclasses.replace(FOG, conditions=("rain",), values=("10 mm/h, wetness 80 %",)),
            "rain alone, 10 mm/h, wetness 80 %",
        ),
        (
            dataclasses.replace(CAMERA, conditions=("camera",), values=("5 values",)),
            "camera alone, 5 values, most of all dirt 15 %",
        ),
        (
            dataclasses.replace(CAMERA, values=("5 values", "")),
            "2 conditions: camera (5 values), person-1",
        ),
        (
            dataclasses.replace(CAMERA, values=("dirt 30 %", "")),
            "2 conditions: camera (dirt 30 %), person-1",
        ),
        (CAMERA, "2 conditions: camera (dirt 15 %), person-1"),
        (
            dataclasses.replace(FOG, conditions=tuple("abcdef"), values=("",) * 6),
            "6 conditions: a, b, c, d, 2 more",
        ),
        (Severity(about="conditions"), "nothing unusual"),
        (NO_SEVERITY, ""),
    ],
)
def test_severity_says_what_it_took(severity: Severity, text: str) -> None:
    assert severity.text == text


def test_order_is_grade_then_objects_then_interference_then_speed() -> None:
    ordered = [
        PERSON,
        dataclasses.replace(PERSON, speed_mps=2.0),
        dataclasses.replace(PERSON, objects=2, speed_mps=0.1),
        dataclasses.replace(DOG, grade="curious", interference_s=9.0),
        dataclasses.replace(DOG, objects=1, interference_s=5.0, speed_mps=8.0),
        DOG,
        dataclasses.replace(DOG, interference_s=4.0, speed_mps=1.0),
        dataclasses.replace(PERSON, grade="hostile"),
        dataclasses.replace(PERSON, grade=""),
        NO_SEVERITY,
    ]
    shuffled = random.Random(0).sample(ordered, len(ordered))
    assert sorted(shuffled) == ordered


def test_fewer_conditions_come_before_milder_ones() -> None:
    two = dataclasses.replace(FOG, conditions=("fog", "wind"), largest_share=0.1)
    assert sorted([two, FOG]) == [FOG, two]
    assert dataclasses.replace(FOG, largest_share=0.2) < FOG


@pytest.mark.parametrize("severity", [None, NO_SEVERITY, PERSON, FOG])
def test_ledger_keeps_severities(severity: Severity | None) -> None:
    result = flight_result("IV:dog:descent:seen", severity=severity)
    assert parse_result(result.dumps()) == result


def test_report_holds_only_facts_that_count() -> None:
    assert NO_SEVERITY.to_json(took=False) == {"about": "", "took": False, "text": ""}
    assert PERSON.to_json(took=True)["grade"] == "careless"
    assert "conditions" not in PERSON.to_json(took=True)
    assert FOG.to_json(took=True)["conditions"] == ["fog"]


def test_only_a_shrunk_case_says_what_it_took() -> None:
    assert FOG.to_json(took=True)["text"] == "fog alone, visibility 11 m"
    assert FOG.to_json(took=False)["text"] == "fog (visibility 11 m)"


@pytest.mark.parametrize(
    ("severity", "unusual"),
    [
        (FOG, "fog (visibility 11 m)"),
        (CAMERA, "camera (dirt 15 %), person-1"),
        (
            dataclasses.replace(CAMERA, conditions=("camera",), values=("5 values",)),
            "camera (5 values, most of all dirt 15 %)",
        ),
        (
            dataclasses.replace(FOG, conditions=tuple("abcdef"), values=("",) * 6),
            "a, b, c, d, 2 more",
        ),
        (PERSON, "a careless person at 1.4 m/s"),
        (Severity(about="conditions"), ""),
        (NO_SEVERITY, ""),
    ],
)
def test_what_was_unusual_is_said_without_a_cause(severity: Severity, unusual: str) -> None:
    assert severity.unusual == unusual


LIGHT_AND_DEPTH = Severity(
    about="conditions",
    conditions=("light", "depth"),
    values=("sun 23 degrees high", "range 7.8 m"),
    largest="sun 23 degrees high",
    largest_share=0.7,
)


def test_data_that_was_never_read_is_no_condition() -> None:
    blind = dataclasses.replace(LIGHT_AND_DEPTH, idle=("depth",))
    assert blind.text == "light alone, sun 23 degrees high"
    assert blind.unusual == "light (sun 23 degrees high)"
    # What a system reads does not change which flights a search prefers.
    assert blind.key == LIGHT_AND_DEPTH.key


def test_a_body_that_comes_while_the_marker_is_covered_says_so() -> None:
    hidden = dataclasses.replace(DOG, when="while 40 % of the marker is covered")
    words = "which comes while 40 % of the marker is covered, 2 others there"
    assert hidden.text == hidden.unusual == f"a chasing dog at 6.1 m/s for 3.5 s, {words}"
    assert hidden.key == DOG.key, "it is no worse for that"
    assert hidden.to_json(took=True)["when"] == hidden.when


@pytest.mark.parametrize(
    ("severity", "text"),
    [
        (FOG, "fog with the marker at this place, visibility 11 m"),
        (CAMERA, "2 conditions with the marker at this place: camera (dirt 15 %), person-1"),
        (
            Severity(about="conditions"),
            "nothing unusual but the place of the marker",
        ),
    ],
)
def test_what_takes_the_place_of_the_marker_too_is_not_alone(severity: Severity, text: str) -> None:
    placed = dataclasses.replace(severity, placed=True)
    assert placed.text == text
    assert placed.unusual == severity.unusual


def test_what_shrinking_did_not_try_is_named() -> None:
    one = dataclasses.replace(LIGHT_AND_DEPTH, untried=("depth",))
    assert one.text == (
        "2 conditions: light (sun 23 degrees high), depth (range 7.8 m); depth was not tried"
    )
    both = dataclasses.replace(LIGHT_AND_DEPTH, untried=("depth", "light"))
    assert both.text.endswith("; depth and light were not tried")
    body = dataclasses.replace(PERSON, objects=2, untried=("fog", "dog-1"))
    assert body.text.endswith("1 other there; fog and dog-1 were not tried")
