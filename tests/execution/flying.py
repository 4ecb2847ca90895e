"""A job on the stand-in simulator, and landing systems for it that die or hang."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import reference_to
from pytest_garl.landing_system import Land, Observation
from pytest_garl.program import AnySystem
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.npc_policy import PolicySpec
from tests.support import tiny_simulator

LAWN = load_map("lawn")


class Good:
    def reset(self, mission: object) -> None: ...

    def step(self, observation: Observation) -> Land:
        return Land()


class Exits(Good):
    def step(self, observation: Observation) -> Land:
        sys.stderr.write("no fuel\n")
        os._exit(3)


class Reports(Good):
    """Dies as a program does that tells of its error itself."""

    def step(self, observation: Observation) -> Land:
        sys.stderr.write("Traceback (most recent call last):\nMemoryError\n")
        os._exit(1)


class Sleeps(Good):
    def step(self, observation: Observation) -> Land:
        time.sleep(60)
        return Land()


class Slow(Good):
    """Takes longer in each call than a limit of 1 s allows, and less than three of them."""

    def step(self, observation: Observation) -> Land:
        time.sleep(1.3)
        return Land()


class Replaces(Good):
    """Replaces a function that every flight needs."""

    def step(self, observation: Observation) -> Land:
        vars(tiny_simulator)["hash_of"] = lambda flight: "bent"
        return Land()


class Loud(Good):
    """Says in two flights more than a pipe holds that nobody reads."""

    def step(self, observation: Observation) -> Land:
        sys.stderr.write("x" * 2**16)
        return Land()


def scenario(fog: float = 0.0) -> Scenario:
    genome = genome_for(LAWN)
    nominal = repair(decode(genome.nominal, genome, map="lawn", seed=1), LAWN)
    return nominal.replace({"environment.fog": fog})


def job_of(system: AnySystem, flights: Path, timeout_s: float = 10.0) -> FlightJob:
    return FlightJob.for_system(
        reference_to(system),
        LAWN,
        PolicySpec(name="none", factory="nowhere:Nothing"),
        simulator=reference_to(tiny_simulator.fly),
        timeout_s=timeout_s,
        path=(str(Path(__file__).parents[2]),),
        flights=flights,
    )
