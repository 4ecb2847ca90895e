from __future__ import annotations

import random

import pytest

from pytest_garl.regressions.investigation import MINIMUM_CASE_FLIGHTS, CaseBuilder
from pytest_garl.scenarios.scenario import Scenario
from tests.regressions.samples import (
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
