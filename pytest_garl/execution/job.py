"""The job of a flight: all that a worker must know to fly a scenario, except the scenario."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pytest_garl.engine import Engine, chosen
from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import REMEDY
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.simulation.system_under_test.takeover import Takeover
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits

TIMEOUT_S = 10.0
"""Wall time that one call of a landing system may take if nobody says otherwise, in seconds."""
_OF_SOURCES = ("sources", "system_sha256")
_FOLDERS = {"path", "flights", "map_folders"}
"""Folders: they may change when a run is resumed, unlike the other facts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightJob:
    """Landing system, simulator, map, NPC policy and limits of flights, as the ledger holds them.

    ``timeout_s`` limits the wall time of one call of the landing system.  ``path`` are the folders
    that imports search, ``flights`` is the folder of the flights' records.  ``sources`` are the
    parts of the landing system by name and hash, of which ``system_sha256`` is the combined hash.
    ``takeover`` lets another pilot take over from the landing system during the flight.
    ``engine`` is the physics engine, that of the process which made the job.
    """

    system: Reference
    system_sha256: str
    simulator: Reference
    map: str
    map_sha256: str
    map_folders: tuple[str, ...]
    npcs: PolicySpec
    limits: Limits
    timeout_s: float
    path: tuple[str, ...]
    flights: str
    sources: tuple[tuple[str, str], ...] = ()
    takeover: Takeover | None = None
    engine: Engine = field(default_factory=chosen)

    @classmethod
    def for_system(
        cls,
        system: Reference,
        map: Map,
        npcs: PolicySpec,
        *,
        flights: Path,
        system_sha256: str = "",
        sources: tuple[tuple[str, str], ...] = (),
        simulator: Reference = BUILT_IN,
        map_folders: Sequence[Path] = (),
        limits: Limits = DEFAULT_LIMITS,
        timeout_s: float = TIMEOUT_S,
        path: Sequence[str] | None = None,
    ) -> FlightJob:
        """Return the job to fly a landing system on a map.

        Imports search the folders of this process unless ``path`` names others.
        """
        return cls(
            system=system,
            system_sha256=system_sha256,
            simulator=simulator,
            map=map.name,
            map_sha256=map.sha256,
            map_folders=tuple(str(folder.absolute()) for folder in map_folders),
            npcs=npcs,
            limits=limits,
            timeout_s=timeout_s,
            path=tuple(entry for entry in (sys.path if path is None else path) if entry),
            flights=str(flights),
            sources=sources,
        )

    def load_map(self) -> Map:
        """Return the map of its flights."""
        return load_map(self.map, tuple(Path(folder) for folder in self.map_folders))

    def directed_by(self, director: str) -> FlightJob:
        """Return the job with another director of its NPCs, if their policy has one."""
        return dataclasses.replace(self, npcs=self.npcs.directed_by(director))

    def differences(self, other: FlightJob) -> tuple[str, ...]:
        """Return the names of the facts that make results of ``other`` not comparable."""
        mine, theirs = dataclasses.asdict(self), dataclasses.asdict(other)
        keys = [key for key in mine if key not in _FOLDERS and mine[key] != theirs[key]]
        if "sources" in keys:
            names = {name for name, _ in {*self.sources} ^ {*other.sources}}
            keys = [*sorted(names), *(key for key in keys if key not in _OF_SOURCES)]
        if self.npcs.sha256 != other.npcs.sha256 and self.npcs.name == other.npcs.name:
            keys = [f"the weights {self.npcs.name}" if key == "npcs" else key for key in keys]
        return tuple(keys)

    def flown_facts(self) -> str:
        """Return as JSON all facts on which a flight depends: all but the folders."""
        facts = {key: each for key, each in dataclasses.asdict(self).items() if key not in _FOLDERS}
        return json.dumps(facts, sort_keys=True)

    def record(self, flight: FlightId) -> Path:
        """Return the file of the record of one of its flights."""
        return flight.record(Path(self.flights))

    def dumps(self) -> str:
        """Return it as JSON."""
        return json.dumps(dataclasses.asdict(self), sort_keys=True)


def parse_job(text: str) -> FlightJob:
    """Return the job in ``text``; raise LedgerError for a damaged one."""
    try:
        return dataclass_from(FlightJob, parse_json(text))
    except ValueError as error:
        raise LedgerError(f"a job in the ledger is damaged: {error}. {REMEDY}") from error
