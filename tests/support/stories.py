"""NPCs with a story on the lawn without trees, moved without a UAV that answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups import MOMENTS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Placed, start_genes
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import with_all_values
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, NpcPolicy, Situation
from pytest_garl.simulation.physics.npc import Npc

EMPTY = dataclasses.replace(load_map("lawn"), bodies=())
TICK_S = 1 / 60
Vector = tuple[float, float, float]
NEVER = float("inf")


def scenario_with(
    name: str,
    start_m: tuple[float, float],
    speed_mps: float,
    values: Mapping[str, float],
    height_m: float | None = None,
) -> Scenario:
    """Return a nominal scenario with one NPC that has a story."""
    genome = genome_for(EMPTY)
    kind = dict(EMPTY.all_objects)[name]
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    genes = dict(scenario.genes) | with_all_values(values, name, kind)
    if height_m is not None:
        genes[f"{name}.height_m"] = height_m
    scenario = dataclasses.replace(scenario, genes=tuple(genes.items()))
    share = Placed(scenario, EMPTY).npc(name).type.share_of(speed_mps)
    scenario = scenario.replace({**start_genes(name, start_m, EMPTY), f"{name}.velocity": share})
    return scenario.without(*(each for each, _ in EMPTY.all_objects if each != name))


def walk(
    scenario: Scenario,
    name: str,
    *,
    seconds: float,
    uav: Callable[[float], Vector] = lambda time_s: (0.0, 0.0, 9.0),
    moments: tuple[float, ...] = (0.0, NEVER, NEVER, NEVER),
    policy: NpcPolicy | None = None,
    uav_mps: Vector = (0.0, 0.0, 0.0),
    map: Map = EMPTY,
) -> np.ndarray:
    """Return the NPC's place (n, 3) at each tick of 1/60 s; it stays where it is between two."""
    placed = Placed(scenario, map)
    npc = Npc(placed, name, policy or policy_spec("graded").make())
    places = []
    came_s = (*moments, *(NEVER for _ in MOMENTS[len(moments) :]))
    for tick in range(round(seconds / TICK_S)):
        now = tick * TICK_S
        known = tuple(each if each <= now else NEVER for each in came_s)
        if tick % round(DECISION_STEP_S / TICK_S) == 0:
            situation = Situation(
                time_s=now,
                self=npc.state,
                others=(),
                uav_position_m=uav(now),
                uav_velocity_mps=uav_mps,
                marker_position_m=(0.0, 0.0),
                map=placed.map,
                scenario=scenario,
                moments_s=(*known, npc.met_s, npc.decided_s),
            )
            if tick == 0:
                npc.policy.reset(situation, np.random.default_rng(0))
            npc.decide(situation)
        npc.update(now, known, uav(now), uav_mps)
        npc.advance(TICK_S)
        places.append(npc.position_m)
    return np.array(places)
