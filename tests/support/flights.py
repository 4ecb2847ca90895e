"""Landing systems that follow a script, on an empty map with NPCs that stand."""

from __future__ import annotations

import dataclasses
from typing import Any

from pytest_garl import (
    Command,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.landing_system import Airframe
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.validity import repair

LAWN = load_map("lawn")


EMPTY = dataclasses.replace(LAWN, objects=())


STAND = policy_spec("stationary")


def nominal(**genes: float) -> Any:
    genome = genome_for(EMPTY)
    scenario = decode(genome.nominal, genome, map="lawn", seed=5)
    values = {key.replace("__", "."): value for key, value in genes.items()}
    return repair(scenario.replace(values), EMPTY)


class Scripted:
    airframe = Airframe(latency_s=0.0)
    needs_camera = False

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m

    def hover(self, height: float) -> PositionSetpoint:
        return PositionSetpoint(position_m=(self.home[0], self.home[1], height))


class Falls(Scripted):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 5:
            return self.hover(6.0)
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, -4.0))


class HitsATree(Scripted):
    def step(self, observation: Observation) -> Command:
        if observation.time_s < 3:
            return self.hover(2.0)
        return PositionSetpoint(position_m=(4.6, 4.2, 2.0))


class Hovers(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(3.0)
