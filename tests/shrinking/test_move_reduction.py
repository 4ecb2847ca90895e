from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.cases.case import RecordedBehaviour
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.files import is_in_units
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.placed import Placed
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.shrinking.case_flights import find_colliding_object, recorded_behaviour
from pytest_garl.shrinking.move_reduction import _round, shortened, shorter_records
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.cases.samples import (
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


def test_shortened_moves_have_four_digits_and_are_no_longer_than_they_were() -> None:
    made = ((0.8080573960675794, -0.5891037639164115), (-1.0, 0.0), (0.57, -0.0))
    found = shortened(RecordedBehaviour(moves=((COLLIDING_OBJECT, made),)))
    assert found.moves == ((COLLIDING_OBJECT, ((0.808, -0.5891), (-1.0, 0.0), (0.57, 0.0))),)
    assert "-0.0)" not in repr(found.moves)


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


SCENARIO = random_scenarios(LAWN, genome_for(LAWN), 5, 0, 1)[0]


@given(st.floats(0, 1), st.floats(0, 2 * math.pi))
def test_rounded_move_is_no_longer_than_one(length: float, angle: float) -> None:
    move = length * math.cos(angle), length * math.sin(angle)
    x, y = _round(*move)
    assert math.hypot(x, y) <= 1
    assert math.dist(move, (x, y)) < 0.03
    assert (round(x, 2), round(y, 2)) == (x, y)


@pytest.mark.sim
def test_shorter_record_ends_where_the_longer_one_ends() -> None:
    flight = fly(SCENARIO, ReferencePilot, policy_spec("waypoint"), time_limit_s=12)
    moves = tuple(
        (item.name, tuple((float(x), float(y)) for x, y in item.moves)) for item in flight.objects
    )
    name = flight.objects[1].name
    found = list(shorter_records(SCENARIO, moves, flight, name, LAWN))
    assert len(found) >= 2
    waiting, shorter = found[0]
    assert problems(waiting, LAWN) == ()
    assert is_in_units(waiting, LAWN)
    own = dict(shorter)[name]
    assert len({*own[:-4]}) == 1
    assert own[0] == (0.0, 0.0)
    last = fly(waiting, ReferencePilot, recorded_spec(dict(shorter)), time_limit_s=12)
    ends = [f.objects[1].track.position_m[-1, :2] for f in (flight, last)]
    # It starts from standing where the longer one walked by, so it falls behind: by v² / 2a while
    # it gains speed, and by v t while it turns from where it faced, half around at most.
    npc = Placed(SCENARIO, LAWN).npc(name)
    speed_mps, kind = npc.speed_mps, npc.type
    gaining_m = speed_mps**2 / (2 * kind.acceleration_mps2)
    z, w = last.objects[1].track.attitude[0, 2:]
    along = ends[1] - last.objects[1].track.position_m[0, :2]
    turn_rad = abs(
        math.remainder(math.atan2(along[1], along[0]) - 2 * math.atan2(z, w), 2 * math.pi)
    )
    behind_m = gaining_m + speed_mps * turn_rad / kind.turn_rate_radps
    assert np.linalg.norm(ends[0] - ends[1]) < behind_m + 0.1
