from __future__ import annotations

import dataclasses

from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.story import with_all_values
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.shrinking.robustness import neighbours

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


def test_neighbours_keep_choices_and_move_times_a_little() -> None:
    told = with_all_values(
        {"grade": 1.0, "body": 1.0, "phase": 2.0, "delay_s": 8.0, "lasts_s": 6.0},
        "person-1",
        "person",
    )
    scenario = dataclasses.replace(SCENARIO, genes=(*SCENARIO.genes, *told.items()))
    for each in neighbours(scenario, LAWN):
        for name in ("grade", "body", "phase"):
            assert each[f"person-1.{name}"] == told[f"person-1.{name}"]
        # A bird flies half a metre in that time.
        assert 0 < abs(each["person-1.delay_s"] - 8.0) <= 0.041


def test_neighbours_move_the_begin_of_an_event_and_keep_its_moment() -> None:
    outage = {"outage.after": 2.0, "outage.from_s": 4.0, "outage.lasts_s": 2.0}
    found = neighbours(SCENARIO.replace(outage), LAWN)
    assert {each["outage.after"] for each in found} == {2.0}
    moved_s = [abs(each["outage.from_s"] - 4.0) for each in found]
    assert 0.1 < max(moved_s) <= 0.6, "about a decision of the director"
    assert min(moved_s) > 0
    at_once = neighbours(SCENARIO.replace(outage | {"outage.from_s": 0.0}), LAWN)
    assert all(0 <= each["outage.from_s"] <= 0.6 for each in at_once)
