from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.plan import ESCAPE_FLIGHTS, EXCEPTION_FLIGHTS, FEWEST_FOR_VIOLATION
from pytest_garl.triage.allowance import Allowance
from tests.cases.samples import make_case_request, violating_scenario
from tests.support.results import crash

BUDGET = 12


def kind(raised: str = "", signature: str = "IV:dog") -> CaseRequest:
    request = make_case_request(BUDGET, violating_scenario())
    ((scenario, flight),) = request.violations
    result = dataclasses.replace(flight.result, crash=crash(raised) if raised else None)
    violation = scenario, dataclasses.replace(flight, result=result)
    return dataclasses.replace(request, signature=signature, violations=(violation,))


def taken(cap: int | None, *requests: CaseRequest) -> list[int]:
    allowance = Allowance(cap)
    return [allowance.take(each) for each in requests]


@pytest.mark.parametrize("cap", [None, 100])
def test_each_kind_has_all_its_flights_under_a_high_cap(cap: int | None) -> None:
    kinds = [kind(), kind("raised"), kind("hung"), kind()]
    assert taken(cap, *kinds) == [BUDGET, EXCEPTION_FLIGHTS, EXCEPTION_FLIGHTS, BUDGET]


def test_kinds_get_all_their_flights_in_turn_as_long_as_they_last() -> None:
    assert taken(2 * BUDGET + 1, *[kind()] * 4) == [BUDGET, BUDGET, 0, 0]


def test_the_last_gets_what_is_left_if_it_suffices() -> None:
    cap = BUDGET + FEWEST_FOR_VIOLATION
    assert taken(cap, kind(), kind(), kind()) == [BUDGET, FEWEST_FOR_VIOLATION, 0]


def test_lowest_cap_gives_the_first_kind_all_its_flights() -> None:
    assert taken(1, kind(), kind()) == [BUDGET, 0]


def test_kind_without_escape_needs_fewer_flights() -> None:
    least = FEWEST_FOR_VIOLATION - ESCAPE_FLIGHTS
    off = kind(signature="off:unseen")
    assert taken(BUDGET + least, kind(), off, kind("raised")) == [BUDGET, least, 0]


def test_flights_that_one_left_over_reach_another() -> None:
    allowance = Allowance(BUDGET)
    assert [allowance.take(kind()), allowance.take(kind())] == [BUDGET, 0]
    allowance.give_back(FEWEST_FOR_VIOLATION)
    assert allowance.take(kind()) == FEWEST_FOR_VIOLATION
