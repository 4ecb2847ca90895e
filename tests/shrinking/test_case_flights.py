from __future__ import annotations

import dataclasses

from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.shrinking.case_flights import CaseFlights
from pytest_garl.shrinking.plan import ESCAPE_FLIGHTS, NEIGHBOURS
from pytest_garl.shrinking.robustness import neighbours
from tests.cases.samples import (
    LAWN,
    OBJECT_NAMES,
    VIOLATING_SCENARIO,
    FakeFlights,
    make_case_request,
)

BEHAVIOUR = RecordedBehaviour(moves=((OBJECT_NAMES[0], ((0.5, 0.0),)),))


def test_flights_that_confirm_an_escape_are_kept() -> None:
    flights = CaseFlights(make_case_request(20, VIOLATING_SCENARIO), FakeFlights(lambda *_: True))
    assert flights.left == 20 - ESCAPE_FLIGHTS
    flights.fly_live(VIOLATING_SCENARIO)
    assert flights.left == 19 - ESCAPE_FLIGHTS
    failing = flights.confirm(VIOLATING_SCENARIO, VIOLATING_SCENARIO, BEHAVIOUR)
    assert failing is not None
    assert flights.left == 18 - NEIGHBOURS - ESCAPE_FLIGHTS
    result = flights.result(None, "reason")
    assert result.flights == 2 + NEIGHBOURS


def test_no_flight_is_kept_for_a_violation_that_is_no_collision_with_a_moving_body() -> None:
    request = dataclasses.replace(make_case_request(20, VIOLATING_SCENARIO), signature="off:seen")
    assert CaseFlights(request, FakeFlights(lambda *_: True)).left == 20


def test_confirm_counts_the_neighbours_that_fail() -> None:
    first, *_ = neighbours(VIOLATING_SCENARIO, LAWN)
    flights = CaseFlights(
        make_case_request(20, VIOLATING_SCENARIO),
        FakeFlights(lambda each, _: each in (VIOLATING_SCENARIO, first)),
    )
    failing = flights.confirm(VIOLATING_SCENARIO, VIOLATING_SCENARIO, BEHAVIOUR)
    assert failing is not None
    assert (failing.neighbours_failed, failing.neighbours_flown) == (1, NEIGHBOURS)


def test_confirm_stops_when_too_few_neighbours_can_fail() -> None:
    fly = FakeFlights(lambda each, _: each == VIOLATING_SCENARIO)
    flights = CaseFlights(make_case_request(20, VIOLATING_SCENARIO), fly)
    assert (
        flights.confirm(VIOLATING_SCENARIO, VIOLATING_SCENARIO, BEHAVIOUR, at_least=NEIGHBOURS)
        is None
    )
    assert fly.count == 2


def test_confirm_flies_no_neighbours_of_a_scenario_that_passes() -> None:
    fly = FakeFlights(lambda *_: False)
    assert (
        CaseFlights(make_case_request(20, VIOLATING_SCENARIO), fly).confirm(
            VIOLATING_SCENARIO, VIOLATING_SCENARIO, BEHAVIOUR
        )
        is None
    )
    assert fly.count == 1
