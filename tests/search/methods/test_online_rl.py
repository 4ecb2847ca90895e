from __future__ import annotations

import pytest

from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.search.searches import GENOME, MAP, bred, plan


def test_the_scenarios_are_those_of_random() -> None:
    assert bred(make_method("online-rl", plan()), 3) == bred(make_method("random", plan()), 3)


@pytest.mark.sim
def test_one_npc_acts_at_a_time_and_the_others_stand() -> None:
    (scenario,) = random_scenarios(MAP, GENOME, 4, 0, 1)
    flight = fly(scenario, ReferencePilot, policy_spec("online-rl"), map=MAP, time_limit_s=15)
    acting_npcs = [
        {n for n, move in enumerate(item.moves) if move.any()} | {n for n, _, _ in item.changes}
        for item in flight.objects
    ]
    assert sum(map(len, acting_npcs)) == len(set().union(*acting_npcs)) > 0
