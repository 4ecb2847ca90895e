from __future__ import annotations

from pytest_garl.regressions.case import RecordedBehaviour
from pytest_garl.regressions.case_flights import CaseFlights
from pytest_garl.regressions.case_request import FailingScenario
from pytest_garl.regressions.robustness import NEIGHBOURS, neighbours
from pytest_garl.regressions.simplest_robust import simplest_robust, with_shorter_record
from pytest_garl.scenarios.scenario import Scenario
from tests.regressions.samples import FIRST, LAWN, NAMES, FakeFlights, request

BEHAVIOUR = RecordedBehaviour(moves=((NAMES[0], ((0.5, 0.0),)),))
HISTORY = [FIRST.without(*NAMES[count:]) for count in (3, 2, 1)]


def best(flights: CaseFlights) -> FailingScenario:
    return FailingScenario(
        origin=FIRST,
        scenario=FIRST,
        behaviour=BEHAVIOUR,
        flight=flights.live_flight(FIRST),
        neighbours_failed=1,
        neighbours_flown=NEIGHBOURS,
    )


def reduce(fails: set[Scenario]) -> FailingScenario:
    flights = CaseFlights(request(60, FIRST), FakeFlights(lambda each, _: each in fails))
    return simplest_robust(flights, best(flights), HISTORY, lambda _: BEHAVIOUR)


def test_simplest_robust_steps_back_from_an_edge() -> None:
    complex_, middle, simple = HISTORY
    around = {*neighbours(middle, LAWN)}
    assert reduce({*HISTORY} | around).scenario == middle
    assert reduce({*HISTORY} | around | {*neighbours(simple, LAWN)}).scenario == simple
    assert reduce({*HISTORY, *neighbours(complex_, LAWN)}).scenario == complex_


def test_simplest_robust_keeps_the_best_if_all_sit_on_an_edge() -> None:
    assert reduce({*HISTORY}).scenario == FIRST


def test_flight_without_a_record_has_no_shorter_one() -> None:
    flights = CaseFlights(request(60, FIRST), FakeFlights(lambda *_: True))
    assert with_shorter_record(flights, best(flights)) == (best(flights),)
