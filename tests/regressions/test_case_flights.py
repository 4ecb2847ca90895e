from __future__ import annotations

from pytest_garl.regressions.case import RecordedBehaviour
from pytest_garl.regressions.case_flights import PILOT_FLIGHTS, CaseFlights
from pytest_garl.regressions.robustness import NEIGHBOURS, neighbours
from tests.regressions.samples import FIRST, LAWN, NAMES, FakeFlights, request

BEHAVIOUR = RecordedBehaviour(moves=((NAMES[0], ((0.5, 0.0),)),))


def test_flights_of_the_reference_pilot_are_reserved() -> None:
    flights = CaseFlights(request(20, FIRST), FakeFlights(lambda *_: True))
    assert flights.left == 20 - PILOT_FLIGHTS
    flights.fly_live(FIRST)
    assert flights.left == 19 - PILOT_FLIGHTS
    failing = flights.confirm(FIRST, FIRST, BEHAVIOUR)
    assert failing is not None
    assert flights.left == 18 - NEIGHBOURS - PILOT_FLIGHTS
    flights.avoidability(failing)
    assert flights.left == 18 - NEIGHBOURS - PILOT_FLIGHTS
    result = flights.result(None, "reason")
    assert (result.flights, result.pilot_flights) == (2 + NEIGHBOURS + 2, 2)


def test_confirm_counts_the_neighbours_that_fail() -> None:
    first, *_ = neighbours(FIRST, LAWN)
    flights = CaseFlights(request(20, FIRST), FakeFlights(lambda each, _: each in (FIRST, first)))
    failing = flights.confirm(FIRST, FIRST, BEHAVIOUR)
    assert failing is not None
    assert (failing.neighbours_failed, failing.neighbours_flown) == (1, NEIGHBOURS)


def test_confirm_stops_when_too_few_neighbours_can_fail() -> None:
    fly = FakeFlights(lambda each, _: each == FIRST)
    flights = CaseFlights(request(20, FIRST), fly)
    assert flights.confirm(FIRST, FIRST, BEHAVIOUR, at_least=NEIGHBOURS) is None
    assert fly.count == 2


def test_confirm_flies_no_neighbours_of_a_scenario_that_passes() -> None:
    fly = FakeFlights(lambda *_: False)
    assert CaseFlights(request(20, FIRST), fly).confirm(FIRST, FIRST, BEHAVIOUR) is None
    assert fly.count == 1
