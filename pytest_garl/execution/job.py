"""What a child must know to fly a slot: system, map, policy, limits, simulator."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import REMEDY
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.reference import Reference
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Limits

_OF_SOURCES = ("sources", "system_sha256")
_PLACES = {"path", "flights", "map_folders"}
"""Where things lie: that may change when a run is resumed, what is flown may not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightJob:
    """Everything but the scenario, as it stands in the ledger."""

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
    """What the landing system consists of, by name and hash: ``system_sha256`` taken apart."""

    def differences(self, other: FlightJob) -> tuple[str, ...]:
        """Return what makes results of ``other`` not comparable to this one's."""
        mine, theirs = dataclasses.asdict(self), dataclasses.asdict(other)
        keys = [key for key in mine if key not in _PLACES and mine[key] != theirs[key]]
        if "sources" in keys:
            names = {name for name, _ in {*self.sources} ^ {*other.sources}}
            keys = [*sorted(names), *(key for key in keys if key not in _OF_SOURCES)]
        if self.npcs.sha256 != other.npcs.sha256 and self.npcs.name == other.npcs.name:
            keys = [f"the weights {self.npcs.name}" if key == "npcs" else key for key in keys]
        return tuple(keys)

    def flown_facts(self) -> str:
        """Return as JSON all but where things lie."""
        facts = {key: each for key, each in dataclasses.asdict(self).items() if key not in _PLACES}
        return json.dumps(facts, sort_keys=True)

    def record(self, flight: FlightId) -> Path:
        """Return the file of the record of one of its flights."""
        return flight.record(Path(self.flights))

    def dumps(self) -> str:
        """Return it as JSON."""
        return json.dumps(dataclasses.asdict(self), sort_keys=True)


def loads(text: str) -> FlightJob:
    """Return the job in ``text``; raise LedgerError for a damaged one."""
    try:
        return dataclass_from(FlightJob, parse_json(text))
    except ValueError as error:
        raise LedgerError(f"a job in the ledger is damaged: {error}. {REMEDY}") from error


def dump_scenario(scenario: Scenario) -> str:
    """Return a scenario as one line of JSON."""
    values = {"map": scenario.map, "seed": scenario.seed, "genes": scenario.genes}
    return json.dumps(
        values | ({"absent": scenario.removed_objects} if scenario.removed_objects else {})
    )


def load_scenario(text: str) -> Scenario:
    """Return the scenario in a line of JSON; raise LedgerError for a damaged one."""
    try:
        values = parse_json(text)
        if isinstance(values, dict):
            removed = values.pop("absent", [])
            values["removed_objects"] = removed
        scenario = dataclass_from(Scenario, values)
    except ValueError as error:
        raise LedgerError(f"a scenario in the ledger is damaged: {error}. {REMEDY}") from error
    genes = tuple((key, float(value)) for key, value in scenario.genes)
    return dataclasses.replace(scenario, genes=genes)
