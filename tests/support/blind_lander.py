"""A landing system that comes down on the told coordinate and sees nobody, and its collisions."""

from __future__ import annotations

import functools
import math
from pathlib import Path

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import reference_to
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import save
from pytest_garl.landing_system import (
    Airframe,
    Camera,
    Command,
    Mission,
    Observation,
    PositionSetpoint,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.system_under_test.descent import descend
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

LAWN = load_map("lawn")
CRUISE_M = 8.0


class BlindLander:
    """Climbs, flies to the told coordinate and comes down on it."""

    airframe = Airframe(camera=Camera(width_px=64, height_px=48))

    def reset(self, mission: Mission) -> None:
        self.mission, self.climbed = mission, False

    def step(self, observation: Observation) -> Command:
        x, y, z = (float(value) for value in observation.position_m)
        goal, (home_x, home_y, _) = self.mission.gps_position_m, self.mission.home_m
        self.climbed |= z > CRUISE_M - 0.5
        if not self.climbed:
            return PositionSetpoint(position_m=(home_x, home_y, CRUISE_M))
        if math.dist((x, y), goal) > 0.5 and z > CRUISE_M - 2:
            return PositionSetpoint(position_m=(*goal, CRUISE_M), speed_mps=4.0)
        return descend(goal, (x, y, z), 1.0)


def scenario_with(name: str, velocity: float = 0.6) -> Scenario:
    """Return a clear scenario on the lawn with one object."""
    genome = genome_for(LAWN)
    scenario = repair(decode(genome.nominal, genome, map="lawn", seed=3), LAWN)
    others = [other for other, _ in LAWN.present_objects if other != name]
    return repair(scenario.without(*others).replace({f"{name}.velocity": velocity}), LAWN)


@functools.cache
def blind_flight(name: str, policy: str) -> Flight:
    """Return the flight in which an object that a policy moves runs into the blind lander."""
    return fly(scenario_with(name), BlindLander, policy_spec(policy), map=LAWN)


def completed(flight: Flight, folder: Path, name: str = "flight") -> CompletedFlight:
    """Return a flight as the ledger knows it, with its record in a folder."""
    save(flight, folder / f"{name}.npz")
    result = judged(flight, DEFAULT_LIMITS)
    return CompletedFlight(result=result, sha256=flight.sha256, record=folder / f"{name}.npz")


def job_of(policy: str, folder: Path) -> FlightJob:
    """Return the job of the blind lander's flights."""
    system = reference_to(BlindLander)
    return FlightJob.for_system(system, LAWN, policy_spec(policy), flights=folder)
