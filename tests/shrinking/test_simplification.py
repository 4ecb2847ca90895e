from __future__ import annotations

import dataclasses

from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import with_all_values
from pytest_garl.scenarios.validity import problems
from pytest_garl.shrinking.simplification import (
    Trials,
    bare_scenario,
    bare_scenario_around_marker,
    complexity,
    empty_scenario,
    genome_of_scenario,
    simplifications,
    simplified,
    value_simplifications,
    without_other_objects,
)
from tests.cases.samples import COLLIDING_OBJECT, LAWN, OBJECT_NAMES, VIOLATING_SCENARIO

OTHERS = {*OBJECT_NAMES} - {COLLIDING_OBJECT}


def test_simplifications_come_as_objects_and_conditions_the_mildest_first() -> None:
    scenario = VIOLATING_SCENARIO.replace({"environment.fog": 0.15, "environment.dust": 0.01})
    objects, conditions = simplifications(
        scenario, genome_of_scenario(scenario, LAWN), COLLIDING_OBJECT
    )
    assert {*simplified(scenario, objects).removed_objects} == OTHERS
    first, *others = conditions
    moved = first(scenario)
    assert (moved["marker.x"], moved["environment.dust"]) == (0.0, 0.01)
    dusty, foggy = (
        next(number for number, step in enumerate(others) if step(scenario)[key] == 0)
        for key in ("environment.dust", "environment.fog")
    )
    assert dusty < foggy


def test_bare_scenario_of_a_collision_keeps_the_object_that_was_hit() -> None:
    bare = bare_scenario(VIOLATING_SCENARIO, LAWN, COLLIDING_OBJECT)
    assert {*bare.removed_objects} == OTHERS
    assert (bare["environment.fog"], bare["marker.x"]) == (0.0, 0.0)


def test_bare_scenario_without_a_collision_keeps_the_weather() -> None:
    bare = bare_scenario(VIOLATING_SCENARIO, LAWN, "")
    assert {*bare.removed_objects} == {*OBJECT_NAMES}
    assert bare["environment.fog"] == VIOLATING_SCENARIO["environment.fog"]


def test_bare_scenario_around_the_marker_keeps_its_place() -> None:
    bare = bare_scenario_around_marker(VIOLATING_SCENARIO, LAWN, COLLIDING_OBJECT)
    assert bare["marker.x"] == VIOLATING_SCENARIO["marker.x"]
    assert bare["environment.fog"] == 0.0


def test_scenario_without_other_objects_keeps_everything_else() -> None:
    alone = without_other_objects(VIOLATING_SCENARIO, LAWN, COLLIDING_OBJECT)
    assert alone == VIOLATING_SCENARIO.without(*OTHERS)


def test_empty_scenario_is_nominal_without_objects() -> None:
    empty = empty_scenario(VIOLATING_SCENARIO, LAWN)
    assert {*empty.removed_objects} == {*OBJECT_NAMES}
    assert empty["environment.fog"] == 0.0


def test_how_a_pad_lies_turned_is_a_value_of_its_own() -> None:
    turned = VIOLATING_SCENARIO.replace({"pad.yaw_deg": -152.0, "pad.worn_percent": 18.0})
    steps = value_simplifications(turned, genome_of_scenario(turned, LAWN))["pad"]
    left = [(step(turned)["pad.yaw_deg"], step(turned)["pad.worn_percent"]) for step in steps]
    assert sorted(left) == [(-152.0, 0.0), (0.0, 18.0)]
    blown = VIOLATING_SCENARIO.replace({"wind.mean_mps": 3.0, "wind.towards_deg": 90.0})
    assert value_simplifications(blown, genome_of_scenario(blown, LAWN)) == {}


GENOME = genome_of_scenario(VIOLATING_SCENARIO, LAWN)


def test_complexity_counts_objects_genes_distance_and_digits() -> None:
    found = complexity(VIOLATING_SCENARIO, GENOME)
    assert (found.grade, found.objects) == (0, len(OBJECT_NAMES))
    fewer = VIOLATING_SCENARIO.without(*OBJECT_NAMES[1:]).replace({"environment.fog": 0.0})
    less = complexity(fewer, GENOME)
    assert less.objects == 1
    assert less.genes < found.genes
    assert less.distance < found.distance
    assert less.digits < found.digits


def test_place_of_an_object_counts_by_its_digits_alone() -> None:
    moved = VIOLATING_SCENARIO.replace({f"{COLLIDING_OBJECT}.start_x": 0.9})
    assert complexity(moved, GENOME)[:4] == complexity(VIOLATING_SCENARIO, GENOME)[:4]
    assert complexity(moved, GENOME) < complexity(VIOLATING_SCENARIO, GENOME)


def test_trials_fly_repaired_scenarios() -> None:
    flown: list[Scenario] = []

    def fails(scenario: Scenario) -> bool:
        flown.append(scenario)
        return False

    trials = Trials(VIOLATING_SCENARIO, fails, LAWN, 10)
    trials(
        VIOLATING_SCENARIO.replace(
            {f"{COLLIDING_OBJECT}.start_x": VIOLATING_SCENARIO[f"{OBJECT_NAMES[1]}.start_x"]}
        )
    )
    assert problems(flown[0], LAWN) == ()


def with_story(grade: float, **values: float) -> Scenario:
    told = with_all_values({"grade": grade, **values}, COLLIDING_OBJECT, "person")
    scenario = VIOLATING_SCENARIO
    return dataclasses.replace(scenario, genes=(*scenario.genes, *told.items()))


def test_lower_grade_is_simpler_than_anything_else() -> None:
    chasing = with_story(2.0).without(*OBJECT_NAMES[1:]).replace({"environment.fog": 0.0})
    careless = with_story(0.0)
    genome = genome_of_scenario(careless, LAWN)
    assert complexity(careless, genome) < complexity(chasing, genome)
    assert (complexity(careless, genome).grade, complexity(chasing, genome).grade) == (1, 3)


def test_choices_places_and_times_of_a_story_are_not_counted() -> None:
    plain = with_story(1.0)
    genome = genome_of_scenario(plain, LAWN)
    name = COLLIDING_OBJECT
    other = {
        f"{name}.phase": 2.0,
        f"{name}.body": 1.0,
        f"{name}.delay_s": 7.0,
        f"{name}.crosses_x_m": 1.0,
    }
    assert complexity(plain.replace(other), genome)[:4] == complexity(plain, genome)[:4]
    longer = plain.replace({f"{name}.lasts_s": 9.0})
    assert complexity(longer, genome).distance > complexity(plain, genome).distance
