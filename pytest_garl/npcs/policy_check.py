"""The check of an NPC policy before anything is flown."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import with_all_values
from pytest_garl.simulation.npc_policy import NpcState, PolicySpec, Situation, decision


def check_policy(spec: PolicySpec, map: Map) -> None:
    """Let a policy decide once for each NPC of a map, before anything is flown.

    Raises PolicyError if the policy cannot be made, raises, or returns something else than a move.
    """
    x_min, x_max, y_min, y_max = map.bounds_m
    genome = with_destinations(genome_for(map))
    states = [
        NpcState(
            name=name,
            type=OBJECT_TYPES[type_name],
            position_m=(x_min, y_min, OBJECT_TYPES[type_name].altitude_m),
            velocity_mps=(0.0, 0.0),
            speed_mps=OBJECT_TYPES[type_name].top_speed_mps,
        )
        for name, type_name in map.present_objects
    ]
    for state in states:
        situation = Situation(
            time_s=0.0,
            self=state,
            others=tuple(other for other in states if other is not state),
            uav_position_m=map.uav_start_m,
            uav_velocity_mps=(0.0, 0.0, 0.0),
            marker_position_m=((x_min + x_max) / 2, (y_min + y_max) / 2),
            map=map,
            scenario=_with_stories(decode(genome.nominal, genome, map=map.name, seed=0), map),
        )
        policy = spec.make()
        try:
            policy.reset(situation, np.random.default_rng(0))
        except PolicyError:
            raise
        except Exception as error:
            raise PolicyError(
                f"NPC policy {spec.name!r}: reset raised {type(error).__name__}: {error}"
            ) from error
        decision(policy, situation)


def _with_stories(scenario: Scenario, map: Map) -> Scenario:
    told: dict[str, float] = {}
    for name, kind in map.present_objects:
        told |= with_all_values({}, name, kind)
    return dataclasses.replace(scenario, genes=(*scenario.genes, *told.items()))
