"""The reference pilot lands wherever it can be done."""

from __future__ import annotations

import pytest

from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map, map_names
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.flights import STAND


@pytest.mark.sim
@pytest.mark.parametrize("name", map_names())
def test_the_reference_pilot_lands_where_it_can_be_done(name: str) -> None:
    map = load_map(name)
    landed = 0
    for scenario in random_scenarios(map, genome_for(map), 21, 0, 10):
        flight = fly(scenario, ReferencePilot, STAND)
        landed += flight.outcome == "landed" and flight.final_distance_m < 0.5
    assert landed >= 9
