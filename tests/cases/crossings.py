"""Flights of OpenCV-MLS on the lawn, which gives way to nobody, for tests of crossings."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import reference_to
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.simplification import without_other_objects
from pytest_garl.shrinking.straight_crossing import Encounter, straight_crossing
from pytest_garl.simulation.fly import fly

LAWN = load_map("lawn")
GENOME = genome_for(LAWN)
NOMINAL = repair(decode(GENOME.nominal, GENOME, map="lawn", seed=5), LAWN)


class RealFlights:
    """Flies in this process; ``policies`` are those of the flights so far."""

    def __init__(self, folder: Path, policy: str = "graded") -> None:
        self.job = FlightJob.for_system(
            reference_to(OpenCvLandingSystem), LAWN, policy_spec(policy), flights=folder
        )
        self.policies: list[str] = []

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        slot = Slot(generation=0, index=len(self.policies))
        self.policies.append(job.npcs.name)
        flight = FlightId(search="search", map="lawn", slot=slot)
        result, sha256, _ = fly_job(job, scenario, flight, None)
        return CompletedFlight(result=result, sha256=sha256, record=job.record(flight))

    def request(self, scenario: Scenario, budget: int = 12) -> CaseRequest:
        """Fly a scenario, and return the request for a case of its violation."""
        flight = self(self.job, scenario)
        return CaseRequest(
            name=f"search {flight.signature}",
            signature=flight.signature,
            violations=((scenario, flight),),
            job=self.job,
            map=LAWN,
            budget=budget,
        )


@functools.cache
def undisturbed() -> tuple[tuple[float, float, float, float], ...]:
    """Return (time, x, y, z) of the UAV in a flight without objects."""
    empty = NOMINAL.without(*(name for name, _ in LAWN.present_objects))
    flight = fly(empty, OpenCvLandingSystem, policy_spec("stationary"), map=LAWN)
    rows = np.column_stack([flight.uav.time_s, flight.uav.position_m])
    return tuple((float(t), float(x), float(y), float(z)) for t, x, y, z in rows)


def encounter(
    name: str, kind: str, height_m: float, *, course_rad: float = 0.3, speed_mps: float = 1.4
) -> Encounter:
    """Return the encounter of an object with the UAV when it sinks through a height."""
    time_s, x, y, z = next(row for row in undisturbed() if row[0] > 8 and row[3] < height_m)
    flies = OBJECT_TYPES[kind].flies
    return Encounter(
        name=name,
        type=OBJECT_TYPES[kind],
        kind=dict(LAWN.all_objects)[name],
        time_s=time_s,
        place_m=(x, y, z if flies else 0.0),
        course_rad=course_rad,
        speed_mps=speed_mps,
        uav_m=(x, y, z),
    )


def crossing(met: Encounter) -> Scenario:
    """Return the straight crossing of an encounter's place by its object alone."""
    scenario = straight_crossing(without_other_objects(NOMINAL, LAWN, met.name), met, LAWN)
    assert scenario is not None
    return scenario
