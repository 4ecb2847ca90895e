from __future__ import annotations

import dataclasses

import pytest

from tests.cases.samples import (
    COLLIDING_OBJECT,
    OBJECT_NAMES,
    SIGNATURE,
    VIOLATING_SCENARIO,
    make_case_request,
)
from tests.support.results import crash, flight_result

SIMPLE = VIOLATING_SCENARIO.without(*OBJECT_NAMES[1:])


def test_scenarios_begin_with_the_first_then_come_the_simplest() -> None:
    middle = VIOLATING_SCENARIO.without(*OBJECT_NAMES[2:])
    found = [VIOLATING_SCENARIO.without(OBJECT_NAMES[1]), middle, SIMPLE]
    assert make_case_request(10, *found).scenarios == [found[0], SIMPLE, middle]


@pytest.mark.parametrize(
    ("kind", "is_exception"), [("raised", True), ("hung", True), ("killed", False), (None, False)]
)
def test_request_knows_exceptions(kind: str | None, is_exception: bool) -> None:
    case_request = make_case_request(10, VIOLATING_SCENARIO)
    result = flight_result(SIGNATURE, crash=crash(kind) if kind else None)
    flight = dataclasses.replace(case_request.violations[0][1], result=result)
    assert (
        dataclasses.replace(case_request, violations=((VIOLATING_SCENARIO, flight),)).is_exception
        is is_exception
    )


def test_flight_fails_with_the_signature_of_the_request() -> None:
    case_request = make_case_request(10, VIOLATING_SCENARIO)
    flight = case_request.violations[0][1]
    assert case_request.fails(VIOLATING_SCENARIO, flight)
    other = flight_result("IV:dog:descent:seen", collisions=(COLLIDING_OBJECT,))
    assert not case_request.fails(VIOLATING_SCENARIO, dataclasses.replace(flight, result=other))
