from __future__ import annotations

from pytest_garl.execution.flight_id import Slot
from pytest_garl.search.fixed import FixedScenarios
from pytest_garl.search.methods.random import random_scenarios
from tests.search.searches import GENOME, MAP


def test_each_scenario_is_proposed_in_its_slot() -> None:
    first, second = random_scenarios(MAP, GENOME, 0, 0, 2)
    slots = {Slot(generation=0, index=1): first, Slot(generation=2, index=0): second}
    method = FixedScenarios(slots)
    assert [list(method.ask()) for _ in range(3)] == [
        [first, first],
        [first, first],
        [second, first],
    ]
