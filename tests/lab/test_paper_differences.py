"""The worlds between the paper's and ours: what each changes, and what the paper's code counts."""

from __future__ import annotations

import dataclasses
import math

import pytest

from lab.paper_differences import (
    COUNTS,
    MAP,
    SEEDS,
    SYSTEMS,
    WORLDS,
    keys,
    with_decoy,
    without_limits,
)
from lab.paper_tables import differences, in_our_world
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.object_types import OBJECT_TYPES, ObjectType
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.validity import problems
from pytest_garl.simulation.physics.locomotion import next_course
from tests.lab.experiment.samples import row


@pytest.mark.parametrize("kind", OBJECT_TYPES.values(), ids=lambda kind: str(kind.name))
def test_npcs_without_limits_turn_and_stop_at_once(kind: ObjectType) -> None:
    before = dataclasses.asdict(kind)
    with without_limits():
        body = OBJECT_TYPES[before["name"]]
        assert body.speed_mps(1.0) == 3.0
        course, speed = next_course(body, (3.0, 0.0), 0.0, (-3.0, 0.0), 1 / 240, body.flies)
        assert math.cos(course) == pytest.approx(-1.0)
        _, faster = next_course(body, (-speed, 0.0), math.pi, (-3.0, 0.0), 1 / 240, body.flies)
        assert faster == pytest.approx(3.0)
    assert dataclasses.asdict(kind) == before


def test_limits_come_back_after_an_error() -> None:
    before = OBJECT_TYPES["dog"].top_speed_mps
    with pytest.raises(ZeroDivisionError), without_limits():
        raise ZeroDivisionError
    assert OBJECT_TYPES["dog"].top_speed_mps == before


def test_a_decoy_lies_where_the_seed_says_and_where_it_may() -> None:
    places, genome = set(), genome_for(MAP)
    for seed in range(8):
        scenario = with_decoy(decode(genome.nominal, genome, map=MAP.name, seed=seed))
        (decoy,) = Placed(scenario, MAP).decoys
        assert decoy.kind == "other-id"
        assert math.dist(decoy.place_m, MAP.gps_position_m) <= 7.5 + 1e-6
        assert not [each for each in problems(scenario, MAP) if "decoy" in each]
        places.add(decoy.place_m)
    assert len(places) == 8


def test_tables_name_each_world_and_pair_it_with_ours() -> None:
    assert len(list(keys())) == len(SYSTEMS) * len(WORLDS) * len(SEEDS)
    rows = [
        dict(zip(("system", "world", "seed"), key, strict=True))
        | {"flights": "100", "sha256": ""}
        | dict.fromkeys(COUNTS, "30")
        for key in keys(["MM-MLS"])
        if key[1] == "npcs"
    ]
    counts = {"paper": 20, "violations": 20, "its_code": 20}
    searches = [
        row(system="MM-MLS", map=map, method="garl-paper", seed=seed, budget=budget, **counts)
        for map, budget in (("lawn", 100), ("lawn", 400), ("court", 100))
        for seed in SEEDS
    ]
    text = differences(rows, in_our_world(searches))
    assert text.startswith("6 of 45 searches of 100 flights are flown.")
    assert "| MM-MLS | its code, % | 20.0 | 30.0 | – | – | – |" in text
    assert "| OpenCV-MLS | our definition, % | – | – | – | – | – |" in text
    # Of the eight ways to flip the signs of three equal differences two are as extreme.
    assert "| npcs | 3 | +10.0 (0.250) | +10.0 (0.250) |" in text
