from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.regressions.case import Prevention
from pytest_garl.regressions.case_file import dump_case, parse_case
from pytest_garl.scenarios.maps.map import load_map
from tests.regressions.samples import case, case_with_changes


def test_ids_of_cases_never_change() -> None:
    assert case().id == "lawn-IV-dog-33ab15"
    assert case_with_changes().id == "lawn-IV-dog-96cf0c"


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
            Prevention(answer="sensor-limited", inevitable_s=1.5),
            "sensor-limited: an escape exists 2.0 s before the contact, none 1.5 s before it, the "
            "camera did not show the body before it",
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
