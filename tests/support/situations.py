from __future__ import annotations

import numpy as np

from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, NpcState, Situation

MAP = load_map("court")
GENOME = genome_for(MAP)
SCENARIO = decode(GENOME.nominal, GENOME, map="court", seed=0)


def being(
    place: tuple[float, float], type_name: str = "person", speed_mps: float = 2.0, name: str = "it"
) -> NpcState:
    return NpcState(
        name=name,
        type=OBJECT_TYPES[type_name],
        position_m=(*place, OBJECT_TYPES[type_name].altitude_m),
        velocity_mps=(0.0, 0.0),
        speed_mps=speed_mps,
    )


def situation(
    me: NpcState,
    *,
    uav: tuple[float, float, float] = (0.0, 0.0, 10.0),
    marker: tuple[float, float] = (0.0, 0.0),
    others: tuple[NpcState, ...] = (),
    scenario: Scenario = SCENARIO,
) -> Situation:
    return Situation(
        time_s=0.0,
        self=me,
        others=others,
        uav_position_m=uav,
        uav_velocity_mps=(0.0, 0.0, -1.5),
        marker_position_m=marker,
        map=MAP,
        scenario=scenario,
    )


def walk(name: str, start: tuple[float, float], decisions: int) -> list[tuple[float, float]]:
    """Walk without inertia around a marker at (3, 1)."""
    policy = policy_spec(name).make()
    place, path = start, [start]
    policy.reset(situation(being(place), marker=(3, 1)), np.random.default_rng(0))
    for _ in range(decisions):
        me = being(place)
        move = policy.decide(situation(me, marker=(3, 1)))
        step = me.speed_mps * DECISION_STEP_S
        place = (place[0] + step * move.x, place[1] + step * move.y)
        path.append(place)
    return path
