from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.exit_path import LANDING_ZONE_M
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.recorded import handed_over_spec, recorded_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Situation
from pytest_garl.simulation.physics.npc import Npc
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

LAWN = load_map("lawn")
GENOME = genome_for(LAWN)
STEPS = 30
MoveList = tuple[tuple[float, float], ...]


def walked(
    moves: MoveList,
    start: tuple[float, float],
    *,
    marker: tuple[float, float] = (0.0, 0.0),
    name: str = "person-1",
    seconds: float = 30.0,
) -> list[tuple[float, float]]:
    """Return where an object is at each decision that repeats ``moves`` from ``start``."""
    scenario = decode(GENOME.nominal, GENOME, map="lawn", seed=1)
    genes = {**start_genes(name, start, LAWN), f"{name}.velocity": 0.5}
    scenario = scenario.replace(genes)
    thing = Npc(Placed(scenario, LAWN), name, recorded_spec({name: moves}).make())
    situation = Situation(
        time_s=0.0,
        self=thing.state,
        others=(),
        uav_position_m=(0.0, 0.0, 9.0),
        uav_velocity_mps=(0.0, 0.0, 0.0),
        marker_position_m=marker,
        map=LAWN,
        scenario=scenario,
    )
    thing.policy.reset(situation, np.random.default_rng(0))
    places = []
    for _ in range(round(seconds / DECISION_STEP_S)):
        places.append((thing.x_m, thing.y_m))
        thing.decide(dataclasses.replace(situation, self=thing.state))
        for _ in range(STEPS):
            thing.advance(DECISION_STEP_S / STEPS)
    assert thing.moves[: len(moves)] == [*moves]
    return places


def away(place: tuple[float, float], marker: tuple[float, float] = (0.0, 0.0)) -> float:
    return math.dist(place, marker)


@pytest.mark.parametrize("name", ["person-1", "dog-1", "bird-1"])
def test_a_recorded_npc_continues_over_the_marker_and_leaves(name: str) -> None:
    places = walked(((0.0, 1.0),) * 2, (0.0, -3.0), name=name)
    assert min(map(away, places)) < 1.5
    assert away(places[-1]) >= LANDING_ZONE_M
    assert name == "bird-1" or places[-1][1] > 0
    if name == "bird-1":
        assert min(map(away, places[-20:])) >= LANDING_ZONE_M, "it circles out of the way"
    else:
        assert places[-1] == places[-4], "it stands once it is out of the way"


def test_a_standing_npc_leaves_away_from_the_marker() -> None:
    places = walked(((0.0, -1.0), (0.0, 0.0), (0.0, 0.0)), (-1.0, 1.0))
    assert [away(place) for place in places[4:]] == sorted(away(place) for place in places[4:])
    assert away(places[-1]) >= LANDING_ZONE_M


def test_an_npc_that_never_moved_leaves_the_marker() -> None:
    assert away(walked((), (0.0, 0.0))[-1]) >= LANDING_ZONE_M


def test_an_npc_outside_the_landing_zone_stays_there() -> None:
    places = walked(((0.0, 0.5),), (0.0, -9.0))
    assert away(places[-1]) > 8.0


@pytest.mark.parametrize("marker", [(7.4, 0.0), (-5.0, 5.0), (3.5, 3.0), (0.0, 7.4)])
@pytest.mark.parametrize("heading", [(1.0, 0.0), (0.0, 1.0), (-0.6, 0.8)])
def test_an_npc_leaves_past_trees_and_the_edge_of_the_map(
    marker: tuple[float, float], heading: tuple[float, float]
) -> None:
    start = (marker[0] - heading[0], marker[1] - heading[1])
    assert away(walked((heading,), start, marker=marker)[-1], marker) >= LANDING_ZONE_M - 0.5


def test_the_exit_path_repeats() -> None:
    assert walked(((0.6, 0.8),), (-1.0, 0.0)) == walked(((0.6, 0.8),), (-1.0, 0.0))


SCENARIO = random_scenarios(LAWN, genome_for(LAWN), 5, 0, 1)[0]


@pytest.mark.sim
def test_recorded_moves_give_the_identical_flight() -> None:
    live = fly(SCENARIO, ReferencePilot, policy_spec("random_walk"), time_limit_s=12)
    moves = {item.name: [(float(x), float(y)) for x, y in item.moves] for item in live.objects}
    again = fly(SCENARIO, ReferencePilot, recorded_spec(moves), time_limit_s=12)
    assert again.sha256 == live.sha256


@pytest.mark.sim
def test_reference_pilot_waits_until_the_recorded_person_has_left() -> None:
    genome = genome_for(LAWN)
    nominal = decode(genome.nominal, genome, map="lawn", seed=3)
    names = [name for name, _ in LAWN.present_objects]
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


def test_object_without_recorded_moves_is_refused() -> None:
    with pytest.raises(PolicyError, match="recorded moves: none for"):
        fly(SCENARIO, ReferencePilot, recorded_spec({"cat-1": []}), time_limit_s=1)


def test_policy_takes_over_from_recorded_moves_at_a_time() -> None:
    scenario = decode(GENOME.nominal, GENOME, map="lawn", seed=1)
    live = policy_spec("greedy")
    recorded = recorded_spec({name: ((0.0, 1.0),) * 10 for name, _ in LAWN.present_objects})
    npc = Npc(Placed(scenario, LAWN), "dog-1", handed_over_spec(recorded, live, 1.2).make())
    situation = Situation(
        time_s=0.0,
        self=npc.state,
        others=(),
        uav_position_m=(0.0, 0.0, 9.0),
        uav_velocity_mps=(0.0, 0.0, 0.0),
        marker_position_m=(0.0, 0.0),
        map=LAWN,
        scenario=scenario,
    )
    npc.policy.reset(situation, np.random.default_rng(0))
    moves = [npc.policy.decide(situation) for _ in range(5)]
    # Decisions at 0, 0.5 and 1 s are repeated; that at 1.5 s is the first after 1.2 s.
    assert [(move.x, move.y) for move in moves[:3]] == [(0.0, 1.0)] * 3
    alone = live.make()
    alone.reset(situation, np.random.default_rng(0))
    expected = alone.decide(situation)
    assert (moves[3].x, moves[3].y) == (expected.x, expected.y) != (0.0, 1.0)
    assert handed_over_spec(recorded, live, 1.0).arguments[0] == ("decisions", 2)


def test_scripted_and_recorded_npcs_do_not_read_the_uav() -> None:
    blind = ("destination", "greedy", "random_walk", "stand", "stationary", "waypoint")
    assert not any(policy_spec(name).reads_uav for name in blind)
    assert not recorded_spec({}).reads_uav
    assert policy_spec("dqn").reads_uav
    assert handed_over_spec(recorded_spec({}), policy_spec("dqn"), 1.0).reads_uav


@pytest.mark.parametrize(
    ("name", "grade"),
    [
        ("careless", "careless"),
        ("curious", "curious"),
        ("chasing", "chasing"),
        ("hostile", "hostile"),
        ("dqn", "hostile"),
        ("waypoint", "careless"),
        ("graded", ""),
    ],
)
def test_policy_says_the_grade_of_its_npcs(name: str, grade: str) -> None:
    assert policy_spec(name).grade == grade


def test_recorded_npcs_have_no_grade_of_their_own() -> None:
    assert recorded_spec({}).grade == ""
    assert handed_over_spec(recorded_spec({}), policy_spec("dqn"), 1.0).grade == ""
