from __future__ import annotations

import pytest

from pytest_garl.search.catalogue import make_method
from pytest_garl.search.methods.random import propose
from tests.search.searches import GENOME, MAP, bred, plan


@pytest.mark.parametrize("name", ["online-rl", "surrogate-random"])
def test_methods_with_another_policy_fly_the_scenarios_of_random(name: str) -> None:
    assert bred(make_method(name, plan()), 3) == bred(make_method("random", plan()), 3)


def test_a_generation_depends_on_seed_map_and_number_alone() -> None:
    method = make_method("random", plan(seed=3, population=4))
    method.ask()
    assert list(method.ask()) == list(propose(MAP, GENOME, 3, 1, 4))
