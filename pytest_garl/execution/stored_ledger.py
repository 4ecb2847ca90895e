"""Ledgers of earlier runs: each is checked in full before it is read."""

from __future__ import annotations

import dataclasses
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import get_args

from pytest_garl.errors import GarlError, LedgerError
from pytest_garl.execution.database import VERSION, SearchKind
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import parse_result
from pytest_garl.messages import shortened, shown
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.scenario import Scenario

_TYPES = {
    "run": {"key": "text", "value": "text"},
    "search": {
        "id": "text",
        "system": "text",
        "map": "text",
        "wanted": "integer",
        "job": "text",
        "kind": "text",
    },
    "slot": {
        "search": "text",
        "generation": "integer",
        "slot": "integer",
        "scenario": "text",
        "state": "text",
        "attempts": "integer",
        "priority": "integer",
        "after": "text",
        "result": "text null",
        "objectives": "text null",
        "sha256": "text null",
        "wall_s": "real integer null",
    },
    "meter": {"name": "text", "value": "real integer"},
}
"""The types of values; SQLite itself accepts any type in any column of a damaged page."""
_STATES = ("waiting", "claimed", "flown")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StoredFlight:
    """The scenario of a slot in a search, its landing system, and the name of the NPC policy."""

    system: str
    npcs: str
    scenario: Scenario


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StoredSlot:
    """A slot of an earlier run, in each search that has it."""

    map: str
    slot: Slot
    flights: Mapping[str, StoredFlight]

    def flight(self, search: str, system: str) -> StoredFlight | None:
        """Return the flight of a search; of a landing system if its search is another today."""
        of_system = (each for each in self.flights.values() if each.system == system)
        return self.flights.get(search) or next(of_system, None)


def read_slot(path: Path, map: str, slot: Slot) -> StoredSlot:
    """Return a slot of the ledger at ``path``; raise LedgerError if there is none."""
    if not path.is_file():
        raise LedgerError(
            f"there is no ledger at {path}; run a search first, or give a scenario file"
        )
    with checked_ledger(path) as ledger:
        found = ledger.queries.scenarios(slot.generation, slot.index, map)
        if not found:
            raise LedgerError(f"no such slot in {path}; it holds {flown_slots(ledger)}")
        jobs = {search: parse_job(job) for search, job in ledger.searches()}
        flights = {
            search: StoredFlight(
                system=jobs[search].system.name,
                npcs=jobs[search].npcs.name,
                scenario=scenario,
            )
            for search, scenario in found.items()
        }
        return StoredSlot(map=map, slot=slot, flights=flights)


@contextmanager
def checked_ledger(path: Path) -> Iterator[Ledger]:
    """Open a ledger of an earlier run and check it; raise LedgerError for a damaged one."""
    with closing(Ledger(path)) as ledger:
        check_stored(ledger)
        yield ledger


def stored_flight_s(path: Path) -> float | None:
    """Return the wall time of a flight in the ledger at ``path``; None if nothing tells it."""
    if not path.is_file():
        return None
    try:
        with closing(Ledger(path)) as ledger:
            return ledger.queries.seconds_per_flight()
    except Exception:  # noqa: BLE001 (an earlier ledger that cannot be read costs the forecast only)
        return None


def flown_slots(ledger: Ledger) -> str:
    """Return which slots a ledger holds, as one range for each map."""
    slots: dict[str, list[Slot]] = {}
    for flight in ledger.queries.flights():
        slots.setdefault(flight.id.map, []).append(flight.id.slot)
    ranges = [f"{min(those).id(map)} to {max(those).id(map)}" for map, those in slots.items()]
    return ", ".join(ranges) or "no flights"


def check_stored(ledger: Ledger) -> None:
    """Raise LedgerError, with the first problem found, if a ledger is damaged."""
    problem = _problem(ledger)
    if problem:
        raise LedgerError(
            f"{ledger.path}: is damaged or no ledger of this version: {problem}; search anew, "
            "without --garl-resume"
        )


def _problem(ledger: Ledger) -> str:
    try:
        (answer,) = ledger.database.execute("PRAGMA quick_check(1)").fetchall()[0]
        if answer != "ok":
            return str(answer)
        return (
            next((found for table in _TYPES if (found := _wrong_type(ledger, table))), "")
            or _wrong_version(ledger)
            or _wrong_search(ledger)
            or _wrong_slot(ledger)
        )
    except LedgerError as error:
        return str(error.__cause__ if isinstance(error.__cause__, sqlite3.Error) else error)


def _wrong_type(ledger: Ledger, table: str) -> str:
    names = ", ".join(f"typeof({column})" for column in _TYPES[table])
    for found in ledger.database.execute(f"SELECT DISTINCT {names} FROM {table}"):
        for (column, expected), kind in zip(_TYPES[table].items(), found, strict=True):
            if kind not in expected.split():
                return f"{table}.{column}: found {kind}, expected {' or '.join(expected.split())}"
    return ""


def _wrong_version(ledger: Ledger) -> str:
    found = ledger.facts.ledger_version
    wrong = f"found a ledger of version {shown(found)}, expected {VERSION}"
    return "" if found == VERSION else wrong


def _wrong_search(ledger: Ledger) -> str:
    for search, job, kind, wanted in ledger.database.execute(
        "SELECT id, job, kind, wanted FROM search"
    ):
        if kind not in get_args(SearchKind) or wanted < 0:
            return f"search {shown(search)}: found {shown((kind, wanted))}"
        try:
            parse_job(job)
        except GarlError as error:
            return f"search {shown(search)}: {error.__cause__ or error}"
    return ""


def _wrong_slot(ledger: Ledger) -> str:
    searches = {search for (search,) in ledger.database.execute("SELECT id FROM search")}
    rows = ledger.database.execute(
        "SELECT search, generation, slot, state, scenario, result FROM slot"
    )
    for search, generation, slot, state, scenario, result in rows:
        where = f"slot {generation}/{slot} of {shortened(search)}"
        if search not in searches or min(generation, slot) < 0 or state not in _STATES:
            return f"{where}: found no such search or the state {shown(state)}"
        if (state == "flown") != (result is not None):
            return (
                f"{where}: found the state {state} with{'out' if result is None else ''} a result"
            )
        try:
            parse_scenario(scenario)
            if result is not None:
                parse_result(result)
        except (GarlError, ValueError) as error:
            return f"{where}: {error.__cause__ or error}"
    return ""
