from __future__ import annotations

from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.random import random_scenarios
from tests.search.searches import GENOME, MAP, plan


def test_a_generation_depends_on_seed_map_and_number_alone() -> None:
    method = make_method("random", plan(seed=3, population=4))
    method.ask()
    assert list(method.ask()) == list(random_scenarios(MAP, GENOME, 3, 1, 4))
