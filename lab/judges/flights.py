"""Flights of a judge in its own process: flown, saved, judged; and their twins."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from lab.one_search import Flown
from lab.stand_in import stand_in
from lab.stand_in_way import ORDINARY, STURDY, LandingModel
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, search_key
from pytest_garl.execution.fly_and_judge import fly_job, judged
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import Reference, reference_to, system_named
from pytest_garl.execution.result import FlightResult
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.npcs.domain_policy import GRADED
from pytest_garl.npcs.policy_catalogue import policy_spec
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
LANDINGS = {"ordinary": ORDINARY, "sturdy": STURDY}
"""Landings of the stand-in, to try a judge on."""
MAPS = ("court", "lawn")
MOVED_M = 0.02
"""By so much the start of a twin is moved, in four directions."""


class Flights(Protocol):
    """Flies the scenarios of one landing system on one map, one after the other."""

    @property
    def job(self) -> FlightJob:
        """How the system flies among the NPCs of `field`."""

    @property
    def airframe(self) -> Airframe | None:
        """The airframe of the system; None if no director can learn from the flights."""

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Fly a scenario as a job says."""

    def twins(self, scenario: Scenario) -> Iterator[FlightResult]:
        """Yield the results of four twins whose UAV starts 2 cm away."""


class OwnFlights:
    """Flights of the simulator in this process; the records are kept in a folder.

    What is asked for again is not flown again: arms share scenarios.
    """

    def __init__(self, system: type, map: Map, folder: Path) -> None:
        self._system, self._map = system, map
        self._known: dict[tuple[PolicySpec, Scenario], CompletedFlight] = {}
        self._twins: dict[Scenario, list[FlightResult]] = {}
        self.job = FlightJob.for_system(
            reference_to(system), map, policy_spec(GRADED), flights=folder
        )
        self.airframe: Airframe | None = airframe_of(system)

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Fly a scenario as a job says, and save the record."""
        if (job.npcs, scenario) not in self._known:
            flight = FlightId(search=search_key(str(len(self._known))), map=job.map)
            result, sha256, _ = fly_job(job, scenario, flight, None)
            self._known[job.npcs, scenario] = CompletedFlight(
                result=result, sha256=sha256, record=job.record(flight)
            )
        return self._known[job.npcs, scenario]

    def twins(self, scenario: Scenario) -> Iterator[FlightResult]:
        """Fly the twins, one after the other."""
        if scenario not in self._twins:
            self._twins[scenario] = [
                judged(fly(scenario, self._system, self.job.npcs, map=map), DEFAULT_LIMITS)
                for map in moved(self._map)
            ]
        yield from self._twins[scenario]


class StandInFlights:
    """Arithmetic in place of flights; nothing is recorded."""

    airframe: Airframe | None = None

    def __init__(self, landing: LandingModel, map: Map, folder: Path) -> None:
        self._landing, self._map = landing, map
        self.job = FlightJob.for_system(
            Reference(module=__name__, file="", qualname="StandIn"),
            map,
            policy_spec(GRADED),
            flights=folder,
        )

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Compute what a scenario leads to."""
        result = stand_in(scenario, self._map, self._landing)
        return CompletedFlight(result=result, sha256="", record=Path(job.flights, "none"))

    def twins(self, scenario: Scenario) -> Iterator[FlightResult]:
        """Compute the twins."""
        return (stand_in(scenario, map, self._landing) for map in moved(self._map))


def flights_for(system: str, map: Map, folder: Path) -> Flights:
    """Return the flights of one of :data:`SYSTEMS`, or of a stand-in."""
    if system in LANDINGS:
        return StandInFlights(LANDINGS[system], map, folder)
    return OwnFlights(system_named(SYSTEMS[system]), map, folder)


def fly_each(
    fly: Flights, latest: list[CompletedFlight], npcs: PolicySpec, scenarios: Sequence[Scenario]
) -> Iterator[Flown]:
    """Yield the flights of scenarios; ``latest`` holds the one that was just yielded."""
    for scenario in scenarios:
        flown = fly(dataclasses.replace(fly.job, npcs=npcs), scenario)
        latest[:] = [flown]
        record = load(flown.record) if flown.record.exists() else None
        yield Flown(result=flown.result, record=record)


def moved(map: Map) -> Iterator[Map]:
    """Yield the map with the start 2 cm to the east, west, north and south."""
    x, y, z = map.uav_start_m
    for east, north in ((MOVED_M, 0.0), (-MOVED_M, 0.0), (0.0, MOVED_M), (0.0, -MOVED_M)):
        yield dataclasses.replace(map, uav_start_m=(x + east, y + north, z))


def named(**values: Any) -> str:
    """Return the name of a task's file: its values joined by dashes."""
    return "-".join(
        str(value).replace("+", "_plus").replace("@", "_at") for value in values.values()
    )
