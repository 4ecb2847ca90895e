from __future__ import annotations

import dataclasses

import pytest

from tests.regressions.samples import COLLIDING_OBJECT, FIRST, NAMES, SIGNATURE, request
from tests.support.results import crash, flight_result

SIMPLE = FIRST.without(*NAMES[1:])


def test_scenarios_begin_with_the_simplest() -> None:
    assert request(10, FIRST, SIMPLE).scenarios == [SIMPLE, FIRST]


@pytest.mark.parametrize(
    ("kind", "is_exception"), [("raised", True), ("hung", True), ("killed", False), (None, False)]
)
def test_request_knows_exceptions(kind: str | None, is_exception: bool) -> None:
    asked = request(10, FIRST)
    result = flight_result(SIGNATURE, crash=crash(kind) if kind else None)
    flight = dataclasses.replace(asked.violations[0][1], result=result)
    assert dataclasses.replace(asked, violations=((FIRST, flight),)).is_exception is is_exception


def test_flight_fails_with_the_signature_of_the_request() -> None:
    asked = request(10, FIRST)
    flight = asked.violations[0][1]
    assert asked.fails(FIRST, flight)
    other = flight_result("IV:dog:descent:seen", collisions=(COLLIDING_OBJECT,))
    assert not asked.fails(FIRST, dataclasses.replace(flight, result=other))
