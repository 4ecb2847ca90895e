from __future__ import annotations

import pytest

from pytest_garl.adversary.scripted import policy_spec
from pytest_garl.search.catalogue import make_method
from pytest_garl.search.methods.random_search import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.search.methods.test_nsga2 import GENOME, MAP, plan


def test_the_scenarios_are_those_of_random_search() -> None:
    ours, random = (make_method(name, plan()) for name in ("online-rl", "random"))
    assert [ours.ask() for _ in range(3)] == [random.ask() for _ in range(3)]


@pytest.mark.sim
def test_one_object_acts_at_a_time_and_the_others_stand() -> None:
    (scenario,) = propose(MAP, GENOME, 4, 0, 1)
    flight = fly(scenario, ReferencePilot, policy_spec("online-rl"), map=MAP, time_limit_s=15)
    acted = [
        {n for n, move in enumerate(item.moves) if move.any()} | {n for n, _, _ in item.changes}
        for item in flight.objects
    ]
    assert sum(map(len, acted)) == len(set().union(*acted)) > 0
