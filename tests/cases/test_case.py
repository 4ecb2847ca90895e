from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.cases.case import Prevention
from pytest_garl.cases.case_file import dump_case, parse_case
from pytest_garl.execution.severity import Severity
from pytest_garl.scenarios.maps.loading import load_map
from tests.cases.samples import case, case_with_changes


def test_ids_of_cases_never_change() -> None:
    assert case().id == "lawn-IV-dog-5506d7"
    assert case_with_changes().id == "lawn-IV-dog-0eb186"


RAW_GENES = (
    ("environment.dust", 0.0767732437050385),
    ("environment.fog", 0.1425695544488903),
    ("environment.rain", 0.02162394190794506),
    ("environment.snow", 0.14229741707058657),
    ("environment.road_wetness", 0.046774717801572815),
    ("environment.maple_leaf", 0.06349896734588635),
    ("environment.road_leaf", 0.12415538907306625),
    ("environment.road_snow", 0.061379870455374186),
    ("environment.sun_position", 0.5495936876730595),
    ("marker.x", -0.6483092983222674),
    ("marker.y", 0.7220318591052368),
    ("dog-1.start_x", 0.5007293452601052),
    ("dog-1.start_y", -0.43918248402792015),
    ("dog-1.velocity", 0.48519097443163506),
)
"""Of any digits, as a search method of a user's own may give them."""


def test_a_case_whose_genes_have_any_digits_keeps_its_id_through_its_file() -> None:
    for each, name in (
        (case(), "lawn-IV-dog-33ab15"),
        (case_with_changes(), "lawn-IV-dog-96cf0c"),
    ):
        scenario = dataclasses.replace(each.scenario, genes=RAW_GENES)
        raw = dataclasses.replace(each, scenario=scenario)
        assert raw.id == name
        assert "[genes.environment]\n" in dump_case(raw)
        assert parse_case(dump_case(raw), load_map) == raw


def test_id_names_map_type_and_subject_and_differs_between_scenarios() -> None:
    first, other = case(), case(signature="IV:dog:descent:seen")
    assert first.id.startswith("lawn-IV-dog-")
    assert len(first.id) == len("lawn-IV-dog-") + 6
    assert first.id != other.id
    fixed = dataclasses.replace(first, status="fixed")
    assert fixed.id == first.id
    assert case(signature="V:PlannerError@planning_ego").id.startswith("lawn-V-PlannerError-")
    assert case(signature="I?:unknown").id.startswith("lawn-I-unknown-")


def test_case_of_an_own_assertion_belongs_to_its_test_in_any_file() -> None:
    with_function_name = dataclasses.replace(case(), test="test_own", assertion="12345678")
    with_node_id = dataclasses.replace(with_function_name, test="tests/test_it.py::test_own")
    assert parse_case(dump_case(with_function_name), load_map) == with_function_name
    assert (with_node_id.asserting_test, with_node_id.id) == ("test_own", with_function_name.id)
    assert with_node_id.id != case().id


@pytest.mark.parametrize(
    ("prevention", "text"),
    [
        (Prevention(), ""),
        (
            Prevention(answer="preventable", inevitable_s=0.0, observed_s=2.4),
            "preventable: an escape exists 0.5 s before the contact, the camera showed the body "
            "2.4 s before it",
        ),
        (
            Prevention(answer="preventable", inevitable_s=1.0, escape="motors off"),
            "preventable: the UAV stood on the ground, where stopping the motors is an escape that "
            "needs no camera; an escape exists 1.5 s before the contact, none 1.0 s before it",
        ),
        (
            Prevention(answer="sensor-limited", inevitable_s=1.5),
            "sensor-limited: an escape exists 2.0 s before the contact, none 1.5 s before it, the "
            "camera did not show the body well enough within the last 5.3 s",
        ),
        (
            Prevention(answer="unpreventable", inevitable_s=5.0, observed_s=4.0),
            "unpreventable: no escape exists within the last 5.0 s, the camera showed the body "
            "4.0 s before it",
        ),
    ],
)
def test_prevention_is_told_with_its_seconds(prevention: Prevention, text: str) -> None:
    assert prevention.text == text


def test_a_case_that_was_not_shrunk_is_not_said_to_have_lost_nothing() -> None:
    fog = Severity(about="conditions", conditions=("fog",), values=("",), untried=("fog",))
    nothing = dataclasses.replace(case().evidence, removed="nothing")
    guess = dataclasses.replace(case("II:never-seen"), severity=fog, evidence=nothing)
    assert guess.shrinking == "not shrunk"
    tried = dataclasses.replace(guess, severity=dataclasses.replace(fog, untried=()))
    assert tried.shrinking == "nothing could be left out"
    unflown = dataclasses.replace(nothing, neighbours=0, neighbours_failed=0)
    assert dataclasses.replace(tried, evidence=unflown).shrinking == "not shrunk"
    assert case().shrinking == "shrinking removed 3 of 4 objects"


def test_a_case_without_flights_says_what_it_lacks_of_the_flight_that_was_found() -> None:
    """The twin of a violation without all known causes is no flight that the search found."""
    nothing = dataclasses.replace(case().evidence, removed="nothing")
    found = dataclasses.replace(case(), evidence=nothing)
    assert found.without_flights == "as the search found it, not shrunk"
    lacks = "not shrunk; left out of the flight that was found: 3 of 4 objects"
    assert case().without_flights == lacks


@pytest.mark.parametrize(
    ("removed", "marker_x", "text"),
    [
        ("1 of 1 object, 1 of 2 conditions", 0.3, ", not the marker's place"),
        ("1 of 1 object, 1 of 2 conditions (4 of 5 values)", -0.3, ", not the marker's place"),
        # It was the marker's place.
        ("1 of 2 conditions", 0.0, ""),
        ("1 of 1 object", 0.3, ""),
        ("what was in the way", 0.3, ""),
    ],
)
def test_the_marker_s_place_is_named_if_it_is_a_condition_that_is_left(
    removed: str, marker_x: float, text: str
) -> None:
    """Else "1 of 2 conditions" would contradict "nothing unusual"."""
    sample = case("II:never-seen")
    place = {"marker.x": marker_x, "marker.y": 0.0}
    subject = dataclasses.replace(
        sample,
        severity=Severity(about="conditions"),
        evidence=dataclasses.replace(sample.evidence, removed=removed),
        scenario=sample.scenario.replace(place),
    )
    assert subject.severity.text == "nothing unusual"
    assert subject.removed == f"{removed}{text}"
    assert subject.shrinking == f"shrinking removed {subject.removed}"
