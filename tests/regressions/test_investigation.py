from __future__ import annotations

import random

import pytest

from pytest_garl.regressions.case import RecordedBehaviour
from pytest_garl.regressions.case_flights import CaseFlights
from pytest_garl.regressions.case_request import FailingScenario
from pytest_garl.regressions.investigation import (
    MINIMUM_CASE_FLIGHTS,
    CaseBuilder,
    simplest_robust,
    with_shorter_record,
)
from pytest_garl.regressions.robustness import NEIGHBOURS, neighbours
from pytest_garl.scenarios.scenario import Scenario
from tests.regressions.samples import (
    LAWN,
    OBJECT_NAMES,
    VIOLATING_SCENARIO,
    FakeFlights,
    make_case_request,
    violating_scenario,
)


@pytest.mark.parametrize("seed", range(40))
def test_case_builder_keeps_its_budget(seed: int) -> None:
    chance = random.Random(seed)
    share, budget = chance.random(), chance.randrange(MINIMUM_CASE_FLIGHTS, 40)
    fly = FakeFlights(lambda *_: chance.random() < share)
    scenarios = [violating_scenario(seed=100 * seed + number) for number in range(4)]
    result = CaseBuilder(make_case_request(budget, *scenarios), fly).build()
    assert result.flights == fly.count <= budget


def test_case_builder_steps_back_until_all_neighbours_fail() -> None:
    def fails(scenario: Scenario, npcs: str) -> bool:
        # On the edge: near nominal fog it fails at round values alone.
        fog = scenario["environment.fog"]
        return fog >= 0.04 or (0 < fog < 0.04 and round(fog, 2) == fog)

    result = CaseBuilder(make_case_request(60, VIOLATING_SCENARIO), FakeFlights(fails)).build()
    assert result.case is not None
    assert result.case.evidence.neighbours_failed == 3
    assert result.case.scenario["environment.fog"] >= 0.04


BEHAVIOUR = RecordedBehaviour(moves=((OBJECT_NAMES[0], ((0.5, 0.0),)),))
HISTORY = [VIOLATING_SCENARIO.without(*OBJECT_NAMES[count:]) for count in (3, 2, 1)]


def best(flights: CaseFlights) -> FailingScenario:
    return FailingScenario(
        origin=VIOLATING_SCENARIO,
        scenario=VIOLATING_SCENARIO,
        behaviour=BEHAVIOUR,
        flight=flights.live_flight(VIOLATING_SCENARIO),
        neighbours_failed=1,
        neighbours_flown=NEIGHBOURS,
    )


def reduce(fails: set[Scenario]) -> FailingScenario:
    flights = CaseFlights(
        make_case_request(60, VIOLATING_SCENARIO), FakeFlights(lambda each, _: each in fails)
    )
    return simplest_robust(flights, best(flights), HISTORY, lambda _: BEHAVIOUR)


def test_simplest_robust_steps_back_from_an_edge() -> None:
    complex_, middle, simple = HISTORY
    around = {*neighbours(middle, LAWN)}
    assert reduce({*HISTORY} | around).scenario == middle
    assert reduce({*HISTORY} | around | {*neighbours(simple, LAWN)}).scenario == simple
    assert reduce({*HISTORY, *neighbours(complex_, LAWN)}).scenario == complex_


def test_simplest_robust_keeps_the_best_if_all_sit_on_an_edge() -> None:
    assert reduce({*HISTORY}).scenario == VIOLATING_SCENARIO


def test_flight_without_a_record_has_no_shorter_one() -> None:
    flights = CaseFlights(make_case_request(60, VIOLATING_SCENARIO), FakeFlights(lambda *_: True))
    assert with_shorter_record(flights, best(flights)) == (best(flights),)
