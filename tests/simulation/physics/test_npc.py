"""NPCs keep their limits, and keep out of bodies and of each other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from tests.support.flights import LAWN, Hovers


@pytest.mark.parametrize("policy", ["waypoint", "random_walk"])
def test_npcs_keep_their_limits_and_out_of_bodies(policy: str) -> None:
    scenario = random_scenarios(LAWN, genome_for(LAWN), 11, 0, 1)[0]
    top = {key: 1.0 for key, _ in scenario.genes if key.endswith("velocity")}
    flight = fly(scenario.replace(top), Hovers, policy_spec(policy), time_limit_s=40)
    trunks = [(body.position_m, body.parts[0].size_m[0] / 2) for body in LAWN.bodies]
    for item in flight.objects:
        kind = OBJECT_TYPES[item.type]
        speed = np.linalg.norm(item.track.velocity_mps[:, :2], axis=1)
        assert speed.max() <= kind.top_speed_mps + 1e-9
        assert speed.max() > 0.3
        steps = np.diff(item.track.position_m[:, :2], axis=0)
        assert np.linalg.norm(steps, axis=1).max() <= kind.top_speed_mps * 2 / 24
        if kind.altitude_m == 0:
            for (x, y, _), radius in trunks:
                away = np.hypot(item.track.position_m[:, 0] - x, item.track.position_m[:, 1] - y)
                assert away.min() > radius


@pytest.mark.parametrize("policy", ["greedy", "stand", "dqn"])
def test_npcs_with_one_destination_keep_out_of_each_other(policy: str) -> None:
    scenario = random_scenarios(LAWN, genome_for(LAWN), 11, 0, 1)[0]
    top = {key: 1.0 for key, _ in scenario.genes if key.endswith("velocity")}
    flight = fly(scenario.replace(top), Hovers, policy_spec(policy), time_limit_s=20)
    gaps = []
    for one, other in itertools.combinations(flight.objects, 2):
        kinds = OBJECT_TYPES[one.type], OBJECT_TYPES[other.type]
        if kinds[0].altitude_m == kinds[1].altitude_m:
            away = one.track.position_m[:, :2] - other.track.position_m[:, :2]
            radii = kinds[0].radius_m + kinds[1].radius_m
            gaps.append(np.linalg.norm(away, axis=1).min() - radii)
    assert min(gaps) > -0.02
    if policy != "dqn":
        assert min(gaps) < 0.1
