from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.objectives import time_to_landing_s
from tests.search.searches import GENOME, bred, plan, result
from tests.support.results import flight_result


def test_selection_raises_the_objective() -> None:
    def share(made: Sequence[Sequence[Scenario]]) -> float:
        return float(np.mean([result(s).final_distance_m > 1.0 for made in made for s in made]))

    runs = [bred(make_method("garl-paper", plan(seed, population=20)), 15) for seed in range(4)]
    early = float(np.mean([share(generations[:2]) for generations in runs]))
    late = float(np.mean([share(generations[-5:]) for generations in runs]))
    assert late > early + 0.1


def test_children_inherit_the_seed_of_a_parent() -> None:
    first, second = bred(make_method("garl-paper", plan()), 2)
    assert {each.seed for each in second} <= {each.seed for each in first}


def test_the_time_to_landing_is_that_of_the_touchdown() -> None:
    assert time_to_landing_s(flight_result(elapsed_s=32.0, landed_s=30.0)) == 30.0
    assert time_to_landing_s(flight_result(outcome="gave_up", elapsed_s=50.0)) == 50.0


def test_the_objectives_are_distance_time_and_diversity() -> None:
    method = make_method("garl-paper", plan())
    scenarios = method.ask()
    values = method.tell([FlownScenario(scenario=each, result=result(each)) for each in scenarios])
    rows = GENOME.normalise(np.array([encode(each, GENOME) for each in scenarios]))
    for scenario, row, (distance, elapsed, spread) in zip(scenarios, rows, values, strict=True):
        assert distance == result(scenario).final_distance_m
        assert elapsed == 30.0
        assert spread == pytest.approx(np.linalg.norm(rows - row, axis=1).sum() / len(rows))
