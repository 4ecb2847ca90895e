"""Policies of grades: by story, or one grade for all."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.errors import PolicyError
from pytest_garl.npcs.learned import learned_spec
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.weights import WEIGHTS
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import start_genes
from pytest_garl.scenarios.story import GRADES, with_all_values
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly
from tests.support.situations import being, situation
from tests.support.stories import scenario_with, walk

LAWN = load_map("lawn")


def test_a_scenario_without_stories_needs_a_grade_for_all() -> None:
    policy = policy_spec("graded").make()
    with pytest.raises(PolicyError, match=r"says no grade for it; .*careless.*--garl-npcs"):
        policy.reset(situation(being((1.0, 1.0))), np.random.default_rng(0))
    for name in GRADES[:3]:
        policy_spec(name).make().reset(situation(being((1.0, 1.0))), np.random.default_rng(0))


@pytest.mark.parametrize("grade", GRADES[:3])
def test_graded_moves_an_npc_as_the_policy_of_its_grade(grade: str) -> None:
    values = {"grade": float(GRADES.index(grade)), "lasts_s": 4.0}
    scenario = scenario_with("person-1", (-6.0, 1.0), 1.4, values)

    def uav(time_s: float) -> tuple[float, float, float]:
        return 0.3 * time_s, 0.0, 4.0

    by_story = walk(scenario, "person-1", seconds=8, uav=uav)
    forced = policy_spec(grade).make()
    assert (walk(scenario, "person-1", seconds=8, uav=uav, policy=forced) == by_story).all()


@pytest.mark.sim
def test_a_careless_person_hits_a_uav_that_gives_way_to_nobody() -> None:
    genome = genome_for(LAWN)
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    # At 1.4 m/s it stands on the marker 4 s after the UAV sank past 3 m.
    told = with_all_values({"phase": 2.0, "pause_s": 20.0}, "person-1", "person")
    scenario = dataclasses.replace(scenario, genes=(*scenario.genes, *told.items()))
    scenario = scenario.without(*(name for name, _ in LAWN.all_objects if name != "person-1"))
    place = start_genes("person-1", (-4.0, 0.0), LAWN)
    scenario = repair(scenario.replace({**place, "person-1.velocity": 1.4 / 3}), LAWN)
    flight = fly(scenario, OpenCvLandingSystem, policy_spec("graded"))
    assert flight.outcome == "collision"
    assert flight.contacts[-1].body == "person-1"


def test_weights_of_a_grade_fly_as_a_policy(tmp_path: Path) -> None:
    for suffix in (".npz", ".json"):
        shutil.copy(WEIGHTS / "grades" / f"chasing{suffix}", tmp_path / f"mine{suffix}")
    policy = learned_spec(str(tmp_path / "mine.npz")).make()
    assert getattr(policy, "grade", "") == "chasing"
    manifest = json.loads((tmp_path / "mine.json").read_text())
    manifest["surrogate"]["grades"] = []
    (tmp_path / "mine.json").write_text(json.dumps(manifest))
    with pytest.raises(PolicyError, match=r"names no grade in its manifest; known: curious"):
        learned_spec(str(tmp_path / "mine.npz"))
