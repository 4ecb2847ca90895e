from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.adversary.recorded import LANDING_ZONE_M, recorded_spec
from pytest_garl.errors import PolicyError
from pytest_garl.regressions.move_reduction import _round, shorter_records
from pytest_garl.regressions.robustness import neighbours
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.placement import start_genes
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.methods.random import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

LAWN = load_map("lawn")
SCENARIO = propose(LAWN, genome_for(LAWN), 5, 0, 1)[0]


@given(st.floats(0, 1), st.floats(0, 2 * math.pi))
def test_a_rounded_move_is_no_longer_than_one(length: float, angle: float) -> None:
    move = length * math.cos(angle), length * math.sin(angle)
    x, y = _round(*move)
    assert math.hypot(x, y) <= 1
    assert math.dist(move, (x, y)) < 0.03
    assert (round(x, 2), round(y, 2)) == (x, y)


@pytest.mark.sim
def test_recorded_moves_fly_the_same_flight_to_the_byte() -> None:
    live = fly(SCENARIO, ReferencePilot, policy_spec("random_walk"), time_limit_s=12)
    moves = {item.name: [(float(x), float(y)) for x, y in item.moves] for item in live.objects}
    again = fly(SCENARIO, ReferencePilot, recorded_spec(moves), time_limit_s=12)
    assert again.sha256 == live.sha256


@pytest.mark.sim
def test_a_shorter_record_ends_where_the_longer_one_does() -> None:
    flight = fly(SCENARIO, ReferencePilot, policy_spec("waypoint"), time_limit_s=12)
    moves = tuple(
        (item.name, tuple((float(x), float(y)) for x, y in item.moves)) for item in flight.objects
    )
    name = flight.objects[1].name
    found = list(shorter_records(SCENARIO, moves, flight, name, LAWN))
    assert len(found) >= 2
    waiting, shorter = found[0]
    assert problems(waiting, LAWN) == ()
    own = dict(shorter)[name]
    assert len({*own[:-4]}) == 1
    assert own[0] == (0.0, 0.0)
    last = fly(waiting, ReferencePilot, recorded_spec(dict(shorter)), time_limit_s=12)
    ends = [f.objects[1].track.position_m[-1, :2] for f in (flight, last)]
    assert np.linalg.norm(ends[0] - ends[1]) < 0.6


@pytest.mark.sim
def test_a_system_that_climbs_and_waits_lands_when_the_recorded_person_has_left() -> None:
    genome = genome_for(LAWN)
    nominal = decode(genome.nominal, genome, map="lawn", seed=3)
    names = [name for name, _ in LAWN.object_names]
    alone = nominal.without(*(name for name in names if name != "person-1"))
    start = start_genes("person-1", (4.0, 0.0), LAWN)
    scenario = alone.replace({**start, "person-1.velocity": 0.5, "marker.x": 0.0, "marker.y": 0.0})
    # It stands, walks onto the marker while a pilot would come down, and there the record ends.
    moves = ((0.0, 0.0),) * 20 + ((-1.0, 0.0),) * 6 + ((0.0, 0.0),)
    flight = fly(scenario, ReferencePilot, recorded_spec({"person-1": moves}), time_limit_s=60)
    assert flight.outcome == "landed"
    heights = flight.uav.position_m[:, 2]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(heights[::20]))))
    assert len(turns) >= 2, "it climbed again before it landed"
    x, y = flight.objects[0].track.position_m[-1, :2]
    assert np.hypot(x, y) >= LANDING_ZONE_M


def test_an_object_without_a_record_is_told() -> None:
    with pytest.raises(PolicyError, match="recorded moves: none for"):
        fly(SCENARIO, ReferencePilot, recorded_spec({"cat-1": []}), time_limit_s=1)


def test_neighbours_are_near_always_the_same_and_make_sense() -> None:
    found = neighbours(SCENARIO, LAWN)
    assert found == neighbours(SCENARIO, LAWN)
    assert len({*found, SCENARIO}) == 4
    for each in found:
        assert problems(each, LAWN) == ()
        steps = [abs(each[key] - value) for key, value in SCENARIO.genes]
        assert 0 < max(steps) < 0.02


def test_nominal_weather_stays_nominal_in_neighbours() -> None:
    calm = SCENARIO.replace({"environment.fog": 0.0})
    assert all(each["environment.fog"] == 0.0 for each in neighbours(calm, LAWN))
    assert dataclasses.replace(calm, seed=1) != calm
