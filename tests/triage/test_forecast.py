from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.plan import FEWEST_FOR_VIOLATION
from pytest_garl.triage.forecast import (
    SPENT_SHARE,
    expected_kinds,
    flight_times_with_shrinking,
    flights_after_search,
    remaining_work,
)
from tests.cases.samples import make_case_request, violating_scenario
from tests.support.results import crash

BUDGET = 12


def kind(number: int, *, raised: bool = False) -> CaseRequest:
    request = make_case_request(BUDGET, violating_scenario())
    if raised:
        ((scenario, flight),) = request.violations
        result = dataclasses.replace(flight.result, crash=crash("raised"))
        violation = scenario, dataclasses.replace(flight, result=result)
        request = dataclasses.replace(request, violations=(violation,))
    return dataclasses.replace(request, name=f"search {number}")


KINDS = [kind(number) for number in range(4)]
TIMES = {each.name: 2.0 for each in KINDS}


def test_forecast_divides_the_time_by_the_workers_up_to_the_longest_kind() -> None:
    alone, two, many = (
        remaining_work((), KINDS, {"search": None}, TIMES, workers) for workers in (1, 2, 100)
    )
    assert two.seconds == pytest.approx(alone.seconds / 2)
    assert many.seconds == pytest.approx(alone.seconds / 4)
    assert alone.flights == two.flights
    assert alone.at_most == 4 * BUDGET
    assert remaining_work((), (), {}, {}, 2).seconds == 0


def test_forecast_leaves_out_what_was_flown_beside_the_search() -> None:
    whole = remaining_work([(each, 0) for each in KINDS], (), {"search": None}, TIMES, 1)
    half = remaining_work([(each, 5) for each in KINDS], (), {"search": None}, TIMES, 1)
    assert half.flights == pytest.approx(whole.flights - 4 * 5)
    assert half.at_most == 4 * (BUDGET - 5)


def test_forecast_counts_no_more_kinds_than_there_are_flights_for() -> None:
    work = remaining_work((), KINDS, {"search": FEWEST_FOR_VIOLATION}, TIMES, 1)
    assert work.at_most == FEWEST_FOR_VIOLATION
    assert work.flights == pytest.approx(SPENT_SHARE * FEWEST_FOR_VIOLATION)


def test_forecast_counts_one_flight_of_an_exception() -> None:
    work = remaining_work((), [kind(0, raised=True)], {"search": None}, TIMES, 1)
    assert (work.flights, work.at_most) == (1, 2)


def test_flights_after_search_stay_below_the_cap() -> None:
    assert flights_after_search(0, 12, 40) == flights_after_search(3, 0, 40) == 0
    assert flights_after_search(2, 12, None) == 2 * flights_after_search(1, 12, None)
    assert flights_after_search(20, 12, 8) < 20 + 12
    assert (
        flights_after_search(20, 12, 8)
        <= flights_after_search(20, 12, 80)
        <= flights_after_search(20, 12, None)
    )


@pytest.mark.parametrize("search", [12, 16, 40, 400])
@pytest.mark.parametrize("kinds_per_flight", [0.0, 0.05, 0.1])
def test_forecast_before_a_search_is_right_within_a_factor_of_one_and_a_half(
    search: int, kinds_per_flight: float
) -> None:
    kinds = round(search * kinds_per_flight)
    most = search + flights_after_search(kinds, 12, search)
    assert 1 / 1.5 <= flight_times_with_shrinking(search, 12, 1) / most <= 1.5
    assert flight_times_with_shrinking(search, 0, 1) == search


def test_forecast_knows_that_flights_of_one_kind_follow_each_other() -> None:
    assert flight_times_with_shrinking(16, 16, 16) == pytest.approx((1 + SPENT_SHARE * 16) ** 0.5)


def test_expected_kinds_begin_with_a_guess_and_end_with_what_was_found() -> None:
    assert expected_kinds(0, 0, 40) == pytest.approx(2.4)
    assert expected_kinds(7, 40, 40) == 7
    assert expected_kinds(0, 39, 40) < 0.1
    later = [expected_kinds(5, flown, 40) for flown in (8, 16, 24, 32, 40)]
    assert later == sorted(later, reverse=True)
