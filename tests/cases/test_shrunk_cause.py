"""What a case takes, whether it acts in a scenario, and the twin of the scenario without it."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.shrunk_cause import Cause, cause_of_case
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.simplification import empty_scenario
from tests.cases.samples import LAWN, OBJECT_NAMES, case, violating_scenario

NOTHING = empty_scenario(violating_scenario(), LAWN)
FOG = NOTHING.replace({"environment.fog": 0.2})
DIM = NOTHING.replace({"environment.sun_position": 0.05, "light.turn_deg": 90.0})
JUMP = NOTHING.replace({"jump.distance_m": 2.0})
ALL = FOG.replace({"environment.sun_position": 0.05, "jump.distance_m": 2.0, "wind.mean_mps": 3.0})


def _case(scenario: Scenario, signature: str = "II:lost:descent") -> Case:
    return dataclasses.replace(case(signature), scenario=scenario)


@pytest.mark.parametrize(
    ("scenario", "name"), [(FOG, "fog"), (DIM, "light"), (JUMP, "jump")], ids=lambda each: str(each)
)
def test_twin_lacks_the_cause_and_nothing_else(scenario: Scenario, name: str) -> None:
    cause = cause_of_case(_case(scenario))
    assert cause == Cause(conditions=frozenset({name}))
    assert cause.acts_in(ALL)
    twin = cause.made_nominal(ALL, LAWN)
    assert not cause.acts_in(twin)
    left = {each.cause for each in active_conditions(twin)}
    assert left == {"fog", "light", "jump", "wind"} - {name}
    assert twin.seed == ALL.seed


def test_objects_of_a_kind_are_alike() -> None:
    person = violating_scenario().without(*(each for each in OBJECT_NAMES if each != "person-1"))
    cause = cause_of_case(_case(person))
    assert "person" in cause.objects
    others = violating_scenario().without("person-1")
    assert cause.acts_in(others)
    assert "person-2" in cause.made_nominal(others, LAWN).removed_objects


@pytest.mark.parametrize("signature", ["V:ValueError@step", "abort:blocked", "own:test_it:ab"])
def test_what_an_ending_names_is_no_further_cause(signature: str) -> None:
    cause = cause_of_case(_case(FOG, signature))
    assert not cause
    assert cause.acts_in(NOTHING)
    assert cause.text == "nothing unusual"


def test_body_that_was_hit_is_no_part_of_the_cause_and_fog_is() -> None:
    dog = violating_scenario().without(*(each for each in OBJECT_NAMES if each != "dog-1"))
    shrunk = _case(dog.replace(dict.fromkeys(_weather(dog), 0.0) | {"environment.fog": 0.2}))
    hit = dataclasses.replace(
        shrunk, violation=dataclasses.replace(shrunk.violation, signature="IV:dog:descent:seen")
    )
    assert cause_of_case(hit).objects == frozenset()
    assert "fog" in cause_of_case(hit).conditions
    # Nothing says what an unshrunk collision takes beside the body.
    found = dataclasses.replace(hit, evidence=dataclasses.replace(hit.evidence, neighbours=0))
    assert not cause_of_case(found)


def _weather(scenario: Scenario) -> list[str]:
    return [
        key
        for key, value in scenario.genes
        if key.startswith("environment.") and key != "environment.sun_position" and value
    ]
