from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly


@pytest.mark.sim
@pytest.mark.parametrize("name", ["court", "lawn"])
@pytest.mark.parametrize("count", [2, pytest.param(4, marks=pytest.mark.long)])
def test_it_lands_within_a_foot_in_clear_weather(name: str, count: int) -> None:
    map = dataclasses.replace(load_map(name), objects=())
    genome = genome_for(map)
    rng = np.random.default_rng(40)
    for seed in range(count):
        values = genome.nominal
        values[-2:] = rng.uniform(-1, 1, 2)
        scenario = repair(decode(values, genome, map=name, seed=seed), map)
        flight = fly(scenario, OpenCvLandingSystem, policy_spec("stationary"), map=map)
        assert flight.outcome == "landed"
        assert flight.final_distance_m < 0.3
