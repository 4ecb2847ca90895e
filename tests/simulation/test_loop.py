"""The flight loop: outcomes, broken systems, and the same bytes again."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pytest_garl import (
    Abort,
    Command,
    Land,
    Observation,
    VelocitySetpoint,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot
from tests.support.flights import EMPTY, LAWN, STAND, Falls, HitsATree, Hovers, Scripted, nominal


class Hops(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(2.0) if observation.time_s < 4 else Land()


class GivesUp(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(3.0) if observation.time_s < 3 else Abort()


class Raises(Scripted):
    def step(self, observation: Observation) -> Command:
        raise ZeroDivisionError("no plan")


class ReturnsNan(Scripted):
    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(math.nan, 0.0, 0.0))


class ReturnsNothing(Scripted):
    def step(self, observation: Observation) -> None:
        return None


class WrongShape(Scripted):
    def step(self, observation: Observation) -> Command:
        return VelocitySetpoint(velocity_mps=(0.0, 0.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("system", "outcome"),
    [
        (Hops, "landed"),
        (Falls, "collision"),
        (HitsATree, "collision"),
        (Hovers, "not_landed"),
        (GivesUp, "gave_up"),
        (Raises, "crashed"),
        (ReturnsNan, "crashed"),
    ],
)
def test_each_outcome_of_the_table_can_happen(system: type, outcome: str) -> None:
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=20)
    assert flight.outcome == outcome


@pytest.mark.parametrize(
    ("system", "kind", "words"),
    [
        (Raises, "raised", "no plan"),
        (ReturnsNan, "nonsense", "velocity_mps = (nan"),
        (ReturnsNothing, "nonsense", "step returned None"),
        (WrongShape, "nonsense", "expected 3 finite numbers"),
    ],
)
def test_a_broken_system_is_recorded(system: type, kind: str, words: str) -> None:
    flight = fly(nominal(), system, STAND, map=EMPTY, time_limit_s=5)
    assert flight.crash is not None
    assert flight.crash.kind == kind
    assert words in flight.crash.message
    assert system.__name__ in flight.crash.where or "step" in flight.crash.where


def test_the_same_scenario_flies_the_same_bytes() -> None:
    scenario = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    first = fly(scenario, Hops, policy_spec("random_walk"), time_limit_s=10)
    again = fly(scenario, Hops, policy_spec("random_walk"), time_limit_s=10)
    assert first.sha256 == again.sha256
    assert (first.uav.position_m == again.uav.position_m).all()


def test_removing_an_npc_changes_nothing_for_the_others() -> None:
    scenario = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    names = [name for name, _ in LAWN.present_objects]
    alone = scenario.without(*names[:-1])
    first, second = (
        fly(each, ReferencePilot, policy_spec("waypoint"), time_limit_s=3.0)
        for each in (scenario, alone)
    )
    assert [item.name for item in second.objects] == names[-1:]
    assert np.array_equal(first.objects[-1].track.position_m, second.objects[-1].track.position_m)


def test_another_process_flies_the_same_bytes() -> None:
    code = (
        "from tests.simulation.test_loop import *\n"
        "scenario = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]\n"
        "print(fly(scenario, Hops, policy_spec('waypoint'), time_limit_s=10).sha256)\n"
    )
    root = Path(__file__).parents[2]
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root
    )
    scenario = random_scenarios(LAWN, genome_for(LAWN), 3, 0, 1)[0]
    here = fly(scenario, Hops, policy_spec("waypoint"), time_limit_s=10)
    assert other.stdout.strip() == here.sha256
