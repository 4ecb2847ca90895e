"""What a child must know to fly a slot: system, map, policy, limits, simulator."""

from __future__ import annotations

import dataclasses
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import REMEDY
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.reference import Reference
from pytest_garl.execution.slot import flight_name
from pytest_garl.files.json_values import made, parsed
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Limits

PAPER_LIMIT_S = 120.0
_OF_SOURCES = ("sources", "system_sha256")
_PLACES = {"path", "flights", "map_folders"}
"""Where things lie: that may change when a run is resumed, what is flown may not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
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

    def differences(self, other: Job) -> tuple[str, ...]:
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

    def dumps(self) -> str:
        """Return it as JSON."""
        return json.dumps(dataclasses.asdict(self), sort_keys=True)


def loads(text: str) -> Job:
    """Return the job in ``text``; raise LedgerError for a damaged one."""
    try:
        return made(Job, parsed(text))
    except ValueError as error:
        raise LedgerError(f"a job in the ledger is damaged: {error}. {REMEDY}") from error


def dump_scenario(scenario: Scenario) -> str:
    """Return a scenario as one line of JSON."""
    values = {"map": scenario.map, "seed": scenario.seed, "genes": scenario.genes}
    return json.dumps(values | ({"absent": scenario.absent} if scenario.absent else {}))


def load_scenario(text: str) -> Scenario:
    """Return the scenario in a line of JSON; raise LedgerError for a damaged one."""
    try:
        values = parsed(text)
        scenario = made(Scenario, {"absent": [], **values} if isinstance(values, dict) else values)
    except ValueError as error:
        raise LedgerError(f"a scenario in the ledger is damaged: {error}. {REMEDY}") from error
    genes = tuple((key, float(value)) for key, value in scenario.genes)
    return dataclasses.replace(scenario, genes=genes)


def record_file(job: Job, claim: Claim) -> Path:
    """Return where the record of a claimed slot's flight goes."""
    name = flight_name(claim.search, claim.generation, claim.slot, job.map)
    return Path(job.flights) / f"{name}.npz"


def fly_job(
    job: Job, scenario: Scenario, slot_id: str, guard: Any
) -> tuple[dict[str, Any], str, float]:
    """Fly, judge and save; return the result for the ledger, the flight's hash, its cost.

    A flight that is not one of finite numbers is a finding, and leaves no record.
    """
    from pytest_garl.simulation.flight_file import NotFiniteError, save
    from pytest_garl.verdicts.judge import closest_call, judge, off_marker_m, undecided

    for entry in job.path:
        if entry not in sys.path:
            sys.path.append(entry)
    map = load_map(job.map, tuple(Path(folder) for folder in job.map_folders))
    flight = job.simulator.load()(
        scenario,
        job.system.load(),
        job.npcs,
        map=map,
        time_limit_s=max(PAPER_LIMIT_S, job.limits.time_s),
        guard=guard,
    )
    file = Path(job.flights) / f"{slot_id}.npz"
    try:
        save(flight, file)
    except NotFiniteError as error:
        lost = broken_result("nonsense", "NotFinite", str(error), "", map.diagonal_m)
        return lost, "", flight.wall_s
    call, body = closest_call(flight)
    result = {
        "outcome": flight.outcome,
        "final_distance_m": flight.final_distance_m,
        "elapsed_s": flight.elapsed_s,
        "collisions": [contact.body for contact in flight.contacts]
        if flight.outcome == "collision"
        else [],
        "undecided": undecided(flight),
        "off_marker_m": off_marker_m(flight, job.limits),
        "closest_call": call,
        "closest_body": body,
        "verdict": judge(flight, job.limits).to_json(),
        "crash": dataclasses.asdict(flight.crash) if flight.crash else None,
    }
    return result, flight.sha256, flight.wall_s


def broken_result(
    kind: str, error: str, message: str, text: str, diagonal_m: float, *, inconclusive: bool = False
) -> dict[str, Any]:
    """Return the result of a flight of which there is no record."""
    verb = "made nonsense" if kind == "nonsense" else kind
    story = f"The landing system {verb}: {message}."
    signature = "" if inconclusive else f"V:{kind}:{error}"
    verdict: dict[str, Any] = {
        "outcome": "crashed",
        "primary": None if inconclusive else "crash",
        "violation_type": None if inconclusive else "V",
        "signature": signature,
        "paper_violation": False,
        "margins": [],
        "story": story,
    }
    crash = {"kind": kind, "error": error, "message": message, "where": "", "traceback": text}
    return {
        "outcome": "inconclusive" if inconclusive else "crashed",
        "final_distance_m": diagonal_m,
        "elapsed_s": PAPER_LIMIT_S,
        "collisions": [],
        "undecided": message,
        "off_marker_m": None,
        "closest_call": "",
        "closest_body": "",
        "verdict": verdict,
        "crash": crash,
    }
