from __future__ import annotations

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import ObjectState, Situation

MAP = load_map("court")
GENOME = genome_for(MAP)
SCENARIO = decode(GENOME.nominal, GENOME, map="court", seed=0)


def being(
    place: tuple[float, float], kind: str = "person", speed_mps: float = 2.0, name: str = "it"
) -> ObjectState:
    return ObjectState(
        name=name,
        type=OBJECT_TYPES[kind],
        position_m=(*place, OBJECT_TYPES[kind].altitude_m),
        velocity_mps=(0.0, 0.0),
        speed_mps=speed_mps,
    )


def situation(
    me: ObjectState,
    *,
    uav: tuple[float, float, float] = (0.0, 0.0, 10.0),
    marker: tuple[float, float] = (0.0, 0.0),
    others: tuple[ObjectState, ...] = (),
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
