from __future__ import annotations

import dataclasses

from pytest_garl.regressions.robustness import neighbours
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.methods.random import random_scenarios

LAWN = load_map("lawn")
SCENARIO = random_scenarios(LAWN, genome_for(LAWN), 5, 0, 1)[0]


def test_neighbours_are_near_valid_and_always_the_same() -> None:
    found = neighbours(SCENARIO, LAWN)
    assert found == neighbours(SCENARIO, LAWN)
    assert len({*found, SCENARIO}) == 4
    for each in found:
        assert problems(each, LAWN) == ()
        steps = [abs(each[key] - value) for key, value in SCENARIO.genes]
        assert 0 < max(steps) < 0.02


def test_neighbours_keep_nominal_weather_nominal() -> None:
    calm = SCENARIO.replace({"environment.fog": 0.0})
    assert all(each["environment.fog"] == 0.0 for each in neighbours(calm, LAWN))
    assert dataclasses.replace(calm, seed=1) != calm
