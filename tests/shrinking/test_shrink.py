from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import with_all_values
from pytest_garl.scenarios.validity import problems, repair
from pytest_garl.shrinking.shrink import reset_and_bisect, shrink, shrink_by_hypothesis
from pytest_garl.shrinking.simplification import complexity, genome_of_scenario
from tests.cases.samples import COLLIDING_OBJECT, LAWN, OBJECT_NAMES, VIOLATING_SCENARIO


def fast(scenario: Scenario) -> bool:
    return scenario.get(f"{COLLIDING_OBJECT}.velocity", 0.0) >= 0.3


def in_fog(scenario: Scenario) -> bool:
    return scenario["environment.fog"] >= 0.02 and fast(scenario)


def two_of_them(scenario: Scenario) -> bool:
    return fast(scenario) and OBJECT_NAMES[-1] not in scenario.removed_objects


def test_reset_and_bisect_removes_unneeded_parts_with_few_flights() -> None:
    found = shrink(
        VIOLATING_SCENARIO,
        fast,
        LAWN,
        100,
        colliding_object=COLLIDING_OBJECT,
        passes=(reset_and_bisect,),
    )
    assert set(found.simplest.removed_objects) == {*OBJECT_NAMES} - {COLLIDING_OBJECT}
    assert complexity(found.simplest, genome_of_scenario(VIOLATING_SCENARIO, LAWN)).genes == 1
    assert 0.3 <= found.simplest[f"{COLLIDING_OBJECT}.velocity"] <= 0.3 + 0.9 / 8
    assert found.flights <= 6


@pytest.mark.parametrize("fails", [in_fog, two_of_them])
def test_shrinking_keeps_the_parts_that_a_failure_needs(fails: Callable[[Scenario], bool]) -> None:
    found = shrink(VIOLATING_SCENARIO, fails, LAWN, 100, colliding_object=COLLIDING_OBJECT)
    assert fails(found.simplest)
    assert problems(found.simplest, LAWN) == ()
    assert complexity(found.simplest, genome_of_scenario(VIOLATING_SCENARIO, LAWN)).genes == (
        2 if fails is in_fog else 1
    )


def test_shrinking_keeps_its_budget_and_flies_nothing_twice() -> None:
    seen: list[Scenario] = []

    def fails(scenario: Scenario) -> bool:
        assert scenario not in seen
        seen.append(scenario)
        return in_fog(scenario)

    for budget in (0, 1, 5, 40):
        seen.clear()
        found = shrink(VIOLATING_SCENARIO, fails, LAWN, budget, colliding_object=COLLIDING_OBJECT)
        assert found.flights == len(seen) <= budget


def test_shrinking_is_deterministic() -> None:
    one, other = (
        shrink(VIOLATING_SCENARIO, in_fog, LAWN, 60, colliding_object=COLLIDING_OBJECT)
        for _ in range(2)
    )
    assert one == other


def test_history_holds_failing_scenarios_from_complex_to_simple() -> None:
    history = shrink(
        VIOLATING_SCENARIO, in_fog, LAWN, 60, colliding_object=COLLIDING_OBJECT
    ).history
    genome = genome_of_scenario(VIOLATING_SCENARIO, LAWN)
    assert all(in_fog(each) for each in history)
    sizes = [complexity(each, genome) for each in history]
    assert sizes == sorted(sizes, reverse=True)
    assert len(history) > 2


def test_shrinking_rounds_destinations() -> None:
    genome = with_destinations(genome_for(LAWN))
    row = genome.random(np.random.default_rng(4))
    first = repair(decode(row, genome, map="lawn", seed=1), LAWN)
    first = first.replace(
        {f"{COLLIDING_OBJECT}.velocity": 0.9, f"{COLLIDING_OBJECT}.destination_x": 0.5123}
    )

    def fails(scenario: Scenario) -> bool:
        return fast(scenario) and abs(scenario[f"{COLLIDING_OBJECT}.destination_x"] - 0.5123) < 0.1

    found = shrink(first, fails, LAWN, 100, colliding_object=COLLIDING_OBJECT)
    assert found.simplest[f"{COLLIDING_OBJECT}.destination_x"] == 0.51
    assert found.simplest[f"{COLLIDING_OBJECT}.destination_y"] == pytest.approx(
        first[f"{COLLIDING_OBJECT}.destination_y"], abs=0.005
    )
    assert set(found.simplest.removed_objects) == {*OBJECT_NAMES} - {COLLIDING_OBJECT}
    assert not any(key.startswith(OBJECT_NAMES[-1]) for key, _ in found.simplest.genes)


def test_single_values_of_a_condition_become_nominal() -> None:
    camera = GROUPS["camera"]
    soiled = dict(zip(camera.keys, (0.5, -1.8, 0.7, -2.1, 3.0, 20.0), strict=True))
    first = dataclasses.replace(
        VIOLATING_SCENARIO.without(*OBJECT_NAMES),
        genes=(*VIOLATING_SCENARIO.without(*OBJECT_NAMES).genes, *soiled.items()),
    )
    found = shrink(
        repair(first, LAWN), lambda each: each["camera.dirt_percent"] >= 4, LAWN, 12
    ).simplest
    assert {key: found[key] for key in soiled if found[key]} == {"camera.dirt_percent": 5.0}


def test_hypothesis_lowers_genes_that_can_only_be_lowered_together() -> None:
    def unequal(scenario: Scenario) -> bool:
        fog, dust = scenario["environment.fog"], scenario["environment.dust"]
        return fast(scenario) and abs(fog - dust) < 0.01

    first = VIOLATING_SCENARIO.replace({"environment.dust": 0.12})
    plain = shrink(
        first, unequal, LAWN, 300, colliding_object=COLLIDING_OBJECT, passes=(shrink_by_hypothesis,)
    )
    assert plain.simplest["environment.fog"] == plain.simplest["environment.dust"] == 0


def test_shrinking_leaves_choices_places_and_times_of_a_story_alone() -> None:
    told = {"grade": 2.0, "phase": 2.0, "delay_s": 7.5, "lasts_s": 4.0}
    genes = with_all_values(told, COLLIDING_OBJECT, "person")
    chasing = dataclasses.replace(
        VIOLATING_SCENARIO, genes=(*VIOLATING_SCENARIO.genes, *genes.items())
    )
    flown: list[Scenario] = []

    def fails(scenario: Scenario) -> bool:
        flown.append(scenario)
        return scenario[f"{COLLIDING_OBJECT}.lasts_s"] >= 2.0

    found = shrink(chasing, fails, LAWN, 60, colliding_object=COLLIDING_OBJECT)
    assert 2.0 <= found.simplest[f"{COLLIDING_OBJECT}.lasts_s"] <= 3.0
    for name in ("grade", "phase", "delay_s"):
        assert {each[f"{COLLIDING_OBJECT}.{name}"] for each in flown} == {told[name]}
