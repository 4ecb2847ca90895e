"""Each extra gene acts on a flight; none acts at its nominal value."""

from __future__ import annotations

import pytest

from pytest_garl import Command, Mission, Observation, PositionSetpoint
from pytest_garl.scenarios.extra_genes import EXTRAS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Scripted, nominal


class GoesToTheCoordinate(Scripted):
    def reset(self, mission: Mission) -> None:
        self.place = (*mission.gps_position_m, 3.0)

    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=self.place)


def hash_of_flight(scenario: Scenario) -> str:
    return fly(scenario, GoesToTheCoordinate, STAND, map=EMPTY, time_limit_s=3.0).sha256


@pytest.mark.sim
@pytest.mark.parametrize("name", EXTRAS)
def test_every_extra_gene_changes_a_flight(name: str) -> None:
    keys = [item.key for gene in EXTRAS[name].genes for item in gene.properties]
    whole = nominal()
    without = Scenario(
        map=whole.map,
        seed=whole.seed,
        genes=tuple((key, value) for key, value in whole.genes if key not in keys),
    )
    strong = whole.replace(dict.fromkeys(keys, 1.0))
    assert hash_of_flight(without) == hash_of_flight(whole) != hash_of_flight(strong)
