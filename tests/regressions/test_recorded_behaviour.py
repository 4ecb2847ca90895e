from __future__ import annotations

from pathlib import Path

from pytest_garl.execution.result import CompletedFlight
from pytest_garl.regressions.recorded_behaviour import find_colliding_object, recorded_behaviour
from tests.regressions.samples import (
    COLLIDING_OBJECT,
    LAWN,
    OBJECT_NAMES,
    SIGNATURE,
    VIOLATING_SCENARIO,
    case_with_changes,
    collision_result,
)
from tests.support.results import flight_result


def flight(signature: str) -> CompletedFlight:
    return CompletedFlight(result=collision_result(signature), sha256="", record=Path("none"))


def test_flight_without_a_record_has_no_moves() -> None:
    remaining = VIOLATING_SCENARIO.without(OBJECT_NAMES[-1])
    found = recorded_behaviour(flight(SIGNATURE), remaining, LAWN)
    assert found.moves == tuple((name, ()) for name in OBJECT_NAMES[:-1])


def test_collision_names_the_object_that_was_hit() -> None:
    assert find_colliding_object(flight(SIGNATURE)) == COLLIDING_OBJECT
    assert find_colliding_object(flight("")) == ""
    wall = flight_result(SIGNATURE, violation_type="III", collisions=("wall",))
    assert find_colliding_object(CompletedFlight(result=wall, sha256="", record=Path())) == ""


def test_behaviour_of_some_objects_keeps_their_moves_and_changes() -> None:
    behaviour = case_with_changes().behaviour
    name = behaviour.moves[0][0]
    assert behaviour.only(name) == behaviour
    rest = behaviour.without([name])
    assert not rest.moves
    assert not rest.changes
    assert behaviour.policy.name == "recorded"
