from __future__ import annotations

import dataclasses
import itertools
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.offline_rl import OfflineRl, edits_of, reward
from tests.search.searches import MAP, bred, plan, result

GENOME = with_destinations(genome_for(MAP))


def columns(made: Sequence[Sequence[Scenario]]) -> list[tuple[Scenario, ...]]:
    return list(zip(*made, strict=True))


def test_each_scenario_differs_from_the_one_before_in_its_column_by_one_action() -> None:
    for chain in columns(bred(OfflineRl(plan()), 30)):
        for before, after in itertools.pairwise(chain):
            assert before.seed == after.seed
            changed = [key for key, value in before.genes if after[key] != value]
            assert len(changed) == 1
            key, column = changed[0], GENOME.keys.index(changed[0])
            step, room = 0.1, (GENOME.lower[column], GENOME.upper[column])
            if key.endswith(("start_x", "start_y", "destination_x", "destination_y")):
                step = 0.2
            moved = after[key] - before[key]
            assert abs(moved) == pytest.approx(step) or (
                abs(moved) < step and after[key] == room[int(moved > 0)]
            )
            assert not key.endswith(".velocity")


def test_every_property_but_the_speeds_can_be_edited_both_ways() -> None:
    edits = edits_of(GENOME)
    ways = {(GENOME.keys[edit.column], edit.step > 0) for edit in edits}
    wanted = [key for key in GENOME.keys if not key.endswith(".velocity")]
    assert ways == {(key, up) for key in wanted for up in (True, False)}
    # Eight weathers and the sun, the marker, four starts and four ends of two coordinates.
    assert len(edits) == len(ways) == 2 * (9 + 2 + 16)


def test_chains_begin_with_random_scenarios_of_their_own() -> None:
    first = OfflineRl(plan(population=20)).ask()
    assert len({each.seed for each in first}) == 20
    rows = GENOME.normalise(np.array([encode(each, GENOME) for each in first]))
    assert rows.std(axis=0).min() > 0.15


def test_an_edit_and_its_reverse_never_repeat_a_scenario() -> None:
    made = [each for generation in bred(OfflineRl(plan()), 40) for each in generation]
    assert len({tuple(round(value, 6) for _, value in each.genes) for each in made}) == 320


def test_a_chain_without_open_edits_starts_again() -> None:
    method = OfflineRl(plan(population=1))
    (first,) = method.ask()
    method.tell([FlownScenario(scenario=first, result=result(first))])
    row = encode(first, GENOME)
    for edit in edits_of(GENOME):
        near = row.copy()
        low, high = GENOME.lower[edit.column], GENOME.upper[edit.column]
        near[edit.column] = np.clip(near[edit.column] + edit.step, low, high)
        method._is_new(near)
    (other,) = method.ask()
    assert other.seed != first.seed
    assert sum(other[key] != value for key, value in first.genes) > 20
    method.tell([FlownScenario(scenario=other, result=result(other))])
    assert method._learner.stored == 0


def test_the_reward_adds_shares_of_distance_time_and_diversity() -> None:
    diagonal = math.hypot(20, 40)
    assert reward(0.0, 0.0, 0.0, MAP, GENOME) == 0.0
    assert reward(diagonal, 0.0, 0.0, MAP, GENOME) == pytest.approx(1.0)
    assert reward(0.0, 120.0, 0.0, MAP, GENOME) == pytest.approx(1.0)
    assert reward(0.0, 0.0, math.sqrt(GENOME.size), MAP, GENOME) == pytest.approx(1.0)


def test_diversity_is_measured_to_every_scenario_so_far() -> None:
    method = OfflineRl(plan(population=2))
    rows: list[Any] = []
    for _ in range(3):
        flown = [FlownScenario(scenario=each, result=result(each)) for each in method.ask()]
        own = [GENOME.normalise(encode(item.scenario, GENOME)) for item in flown]
        rows += own
        for row, item, objectives in zip(own, flown, method.tell(flown), strict=True):
            wanted = np.linalg.norm(np.array(rows) - row, axis=1).mean()
            assert objectives == pytest.approx((item.result.final_distance_m, 30.0, wanted))


def test_the_network_learns_which_edit_pays() -> None:
    """If snow on the ground keeps the UAV away, the network learns to add snow."""
    method = OfflineRl(plan(population=20))
    snow = []
    for _ in range(36):
        scenarios = method.ask()
        covers = [each["environment.road_snow"] / 0.15 for each in scenarios]
        method.tell(
            [
                FlownScenario(
                    scenario=each,
                    result=dataclasses.replace(result(each), final_distance_m=40 * cover),
                )
                for each, cover in zip(scenarios, covers, strict=True)
            ]
        )
        snow.append(np.mean(covers))
    assert np.mean(snow[-8:]) > np.mean(snow[:8]) + 0.2


def test_the_network_has_the_papers_size_and_is_updated_once_per_edit() -> None:
    method = OfflineRl(plan())
    bred(method, 11)
    learner = method._learner
    training = learner.training
    assert (training.batch, training.target_every, training.hidden) == (32, 20, (24, 24))
    assert (training.epsilon, training.epsilon_least) == (0.99, 0.01)
    assert learner.stored == 80
    # From the batch's first filling on.
    assert learner.updates == 80 - 31


def test_the_method_leaves_the_global_generator_of_torch_alone() -> None:
    import torch

    torch.manual_seed(7)
    wanted = torch.rand(3)
    torch.manual_seed(7)
    threads = torch.get_num_threads()
    bred(OfflineRl(plan()), 6)
    assert torch.equal(torch.rand(3), wanted)
    assert torch.get_num_threads() == threads


def test_without_torch_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "pytest_garl.npcs.training.dqn", raising=False)
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(GarlError, match=r"offline-rl .*pip install 'pytest-garl\[train\]'"):
        make_method("offline-rl", plan())
