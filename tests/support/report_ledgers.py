"""Ledgers of runs that nobody flew: results and records of flights as a test gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.execution.result import FlightResult
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import save
from pytest_garl.landing_system import Camera
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from tests.support.videos import SCENARIO, Hovers

SYSTEM = "my_stack:Hovers"
FACTS = {"method": "garl", "budget": 3, "seed": 0, "python": "3.11.0", "domain": "field"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Flown:
    """A flight of a ledger: its result, and its record if its process left one."""

    result: FlightResult
    flight: Flight | None = None
    scenario: Scenario = SCENARIO


def write_ledger(
    folder: Path,
    flown: Sequence[Flown],
    *,
    system: str = SYSTEM,
    simulator: Reference = BUILT_IN,
    camera: Camera | None = Hovers.airframe.camera,
    search: str = "0123456789abcdef",
    facts: dict[str, Any] | None = None,
) -> Path:
    """Write a finished run of these flights, all of one generation; return its ledger."""
    module, _, name = system.partition(":")
    job = FlightJob.for_system(
        Reference(module=module, file="", qualname=name),
        load_map("lawn"),
        policy_spec("waypoint"),
        flights=folder / ".garl" / "flights",
        simulator=simulator,
        path=(),
    )
    path = folder / ".garl" / "ledger.sqlite"
    ledger = Ledger.create(path, FACTS | (facts or {}))
    ledger.add_search(search, system, "lawn", len(flown), job.dumps())
    texts = {index: dump_scenario(each.scenario) for index, each in enumerate(flown)}
    ledger.add_slots(search, 0, texts)
    for index, each in enumerate(flown):
        sha256 = ""
        if each.flight is not None:
            sha256 = each.flight.sha256
            slot = FlightId(search=search, map="lawn", slot=Slot(generation=0, index=index))
            save(each.flight, job.record(slot))
        ledger.database.execute(
            "UPDATE slot SET state = 'flown', result = ?, sha256 = ?, wall_s = 1.0 "
            "WHERE search = ? AND slot = ?",
            (each.result.dumps(), sha256, search, index),
        )
    if camera is not None:
        ledger.facts.note_camera(system, camera)
    tests = ("test_it.py::test_it",)
    ledger.facts.note_search(search, SearchKey(system=system, map="lawn", tests=tests))
    ledger.facts.note_began(datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    ledger.facts.note_ended(datetime(2026, 1, 2, 3, 5, 5, tzinfo=UTC))
    ledger.close()
    return path
