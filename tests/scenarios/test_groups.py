"""Each group of conditions acts on a flight; none acts at its nominal values."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl import Command, Mission, Observation, PositionSetpoint
from pytest_garl.scenarios.groups import GROUPS, QUANTITIES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, Scripted, nominal


class GoesToTheCoordinate(Scripted):
    needs_camera = True

    def reset(self, mission: Mission) -> None:
        self.place = mission.gps_position_m

    def step(self, observation: Observation) -> Command:
        # Its height follows what it sees, so that another picture makes another flight.
        seen = float(observation.image.mean()) + float(observation.depth_m.mean())
        return PositionSetpoint(position_m=(*self.place, 3.0 + seen / 100))


def hash_of_flight(scenario: Scenario) -> str:
    return fly(scenario, GoesToTheCoordinate, STAND, map=EMPTY, time_limit_s=3.0).sha256


@pytest.mark.sim
@pytest.mark.parametrize("name", GROUPS)
def test_every_group_changes_a_flight(name: str) -> None:
    # From 10 m above the middle of the map it sees trees and their shadows.
    group, start = GROUPS[name], Start(mode="hover", height_m=10.0)
    without = dataclasses.replace(nominal(), task=Task(start=start))
    # What begins at the end of its range begins after this short flight.
    ends = {
        key: QUANTITIES[key].low if key.endswith((".after", ".from_s")) else QUANTITIES[key].high
        for key in group.keys
    }
    assert hash_of_flight(without) == hash_of_flight(without.replace(group.nominal))
    assert hash_of_flight(without) != hash_of_flight(without.replace(ends))
