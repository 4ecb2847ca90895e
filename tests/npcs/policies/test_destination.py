from __future__ import annotations

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.placed import Placed
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.situations import MAP

NAMES = [name for name, _ in MAP.present_objects]


@pytest.mark.sim
def test_npcs_walk_to_their_destination_and_back() -> None:
    scenario = random_scenarios(MAP, with_destinations(genome_for(MAP)), 2, 0, 1)[0]
    scenario = scenario.replace({f"{name}.velocity": 1.0 for name in NAMES})
    # Clear of bodies, and of each other.
    places = ((-0.8, 0.8), (0.8, 0.8), (-0.8, -0.8), (0.8, -0.8))
    ends = {
        f"{n}.destination_{axis}": at[i]
        for n, at in zip(NAMES, places, strict=True)
        for i, axis in enumerate("xy")
    }
    flight = fly(scenario.replace(ends), ReferencePilot, policy_spec("destination"), map=MAP)
    for item in flight.objects:
        goal = Placed(scenario.replace(ends), MAP).npc(item.name).destination_m
        assert goal is not None
        way = item.track.position_m[:, :2]
        from_goal = np.linalg.norm(way - np.array(goal), axis=1)
        there = int(from_goal.argmin())
        assert from_goal[there] < 1.5, item.name
        from_start = np.linalg.norm(way[there:] - way[0], axis=1)
        assert from_start.min() < 0.5 * from_start[0], item.name


def test_a_scenario_without_destinations_is_an_error() -> None:
    scenario = random_scenarios(MAP, genome_for(MAP), 2, 0, 1)[0]
    with pytest.raises(PolicyError, match=r"no gene 'person-1.destination_x'.*--garl-method"):
        fly(scenario, ReferencePilot, policy_spec("destination"), map=MAP, time_limit_s=1)
