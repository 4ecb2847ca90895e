from __future__ import annotations

from pytest_garl.regressions.complexity import genome_of
from pytest_garl.regressions.simplification import (
    bare_scenario,
    bare_scenario_around_marker,
    empty_scenario,
    simplifications,
    simplified,
    without_other_objects,
)
from tests.regressions.samples import COLLIDING_OBJECT, LAWN, OBJECT_NAMES, VIOLATING_SCENARIO

OTHERS = {*OBJECT_NAMES} - {COLLIDING_OBJECT}


def test_simplifications_come_as_objects_weather_and_the_rest() -> None:
    objects, weather, rest = simplifications(
        VIOLATING_SCENARIO, genome_of(VIOLATING_SCENARIO, LAWN), COLLIDING_OBJECT
    )
    assert {*simplified(VIOLATING_SCENARIO, objects).removed_objects} == OTHERS
    calm = simplified(VIOLATING_SCENARIO, weather)
    assert calm["environment.fog"] == 0.0
    assert calm["environment.sun_position"] == VIOLATING_SCENARIO["environment.sun_position"]
    assert simplified(VIOLATING_SCENARIO, rest)["marker.x"] == 0.0


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
