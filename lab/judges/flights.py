"""Flights of a judge in its own process: flown, saved, judged; and their twins."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pytest_garl.execution.flight_id import CompletedFlight, FlightId, search_key
from pytest_garl.execution.fly_and_judge import fly_job, judged
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import reference_to, system_named
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

SYSTEMS = {
    "opencv": "landing_systems.opencv_mls:OpenCvLandingSystem",
    "tphyolo": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    "mm": "landing_systems.mm_mls:MultiModuleLandingSystem",
}
MAPS = ("court", "lawn")
MOVED_M = 0.02
"""By so much the start of a twin is moved, in four directions."""


class OwnFlights:
    """Flies jobs one after the other and keeps the records in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder, self.flown = folder, 0

    def job(self, system: str, map: Map, npcs: PolicySpec) -> FlightJob:
        """Return the job that flies a landing system "module:Class" on a map."""
        return FlightJob.for_system(
            reference_to(system_named(system)), map, npcs, flights=self._folder
        )

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Fly a scenario as a job says."""
        self.flown += 1
        flight = FlightId(search=search_key(str(self.flown)), map=job.map)
        result, sha256, _ = fly_job(job, scenario, flight, None)
        return CompletedFlight(result=result, sha256=sha256, record=job.record(flight))


def moved_twins(system: str, scenario: Scenario, npcs: PolicySpec) -> Iterator[FlightResult]:
    """Yield the results of four twins whose UAV starts 2 cm away."""
    map, made = load_map(scenario.map), system_named(system)
    x, y, z = map.uav_start_m
    for east, north in ((MOVED_M, 0.0), (-MOVED_M, 0.0), (0.0, MOVED_M), (0.0, -MOVED_M)):
        moved = dataclasses.replace(map, uav_start_m=(x + east, y + north, z))
        yield judged(fly(scenario, made, npcs, map=moved), DEFAULT_LIMITS)


def named(**values: Any) -> str:
    """Return the name of a task's file: its values joined by dashes."""
    return "-".join(
        str(value).replace("+", "_plus").replace("@", "_at") for value in values.values()
    )
