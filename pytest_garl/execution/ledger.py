"""The ledger of a run: facts about the run, its searches, their slots and the results.

It is one SQLite file.  Processes that fly take slots from its queue; reports read its queries.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import (
    REMEDY,
    VERSION,
    Database,
    SearchKind,
    set_aside,
)
from pytest_garl.execution.facts import Facts
from pytest_garl.execution.flight_id import CompletedFlight, FlightId
from pytest_garl.execution.ledger_queries import LedgerQueries
from pytest_garl.execution.ledger_queue import WorkQueue
from pytest_garl.execution.result import FlightResult, parse_result
from pytest_garl.messages import shortened


class Ledger:
    """A run's facts, searches, slots and results; several processes may use it at once.

    ``facts`` are about the run, ``queue`` hands out the slots, ``queries`` reads what was flown.
    If the file cannot be made, read or written, that is a LedgerError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.database = Database(path)
        self.facts = Facts(self.database, path)
        self.queue = WorkQueue(self.database)
        self.queries = LedgerQueries(self.database)

    @classmethod
    def create(cls, path: Path, run: Mapping[str, Any]) -> Ledger:
        """Begin a new run; an older ledger at the same path is renamed to ``...-previous``."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_file():
                set_aside(path)
        except OSError as error:
            raise LedgerError(f"{path}: {error.strerror}. {REMEDY}") from error
        ledger = cls(path)
        ledger.database.create_tables()
        ledger.facts.note_run({**run, "ledger": VERSION})
        return ledger

    @classmethod
    def resume(cls, path: Path, run: Mapping[str, Any]) -> Ledger:
        """Continue an interrupted run; raise LedgerError if it differs from ``run``.

        No other process may be using the ledger: slots in flight are given back.
        """
        if not path.is_file():
            raise LedgerError(f"--garl-resume: there is no ledger at {path}; run without it first")
        try:
            ledger = cls(path)
            version = ledger.facts.ledger_version
            problem = ledger.database.execute("PRAGMA quick_check").fetchone()[0]
        except LedgerError as error:
            problem, version = str(error.__cause__ or error), VERSION
        if problem != "ok":
            raise LedgerError(
                f"--garl-resume: {path} is damaged or no ledger ({problem}); run without "
                "--garl-resume to start over"
            )
        wanted = {**run, "ledger": VERSION}
        found = {"ledger": version, **ledger.facts.of_run(run)}
        differing = [key for key in wanted if wanted[key] != found[key]]
        if differing:
            facts = "; ".join(
                f"{key} was {shortened(str(found[key]))}, is {wanted[key]}" for key in differing
            )
            raise LedgerError(
                f"--garl-resume: {path} belongs to another run: {facts}. Give the same options, or "
                "run without --garl-resume to start over"
            )
        ledger.queue.reset()
        ledger.facts.forget_session()
        return ledger

    def close(self) -> None:
        """Close the file."""
        self.database.close()

    def remove(self) -> None:
        """Remove the closed ledger's files; no later run needs them."""
        for suffix in ("", "-wal", "-shm"):
            self.path.with_name(self.path.name + suffix).unlink(missing_ok=True)
        self.path.with_suffix(".lock").unlink(missing_ok=True)

    def add_search(
        self, search: str, system: str, map: str, wanted: int, job: str, kind: SearchKind = "search"
    ) -> None:
        """Add a search of ``wanted`` slots, unless it is there already."""
        self.database.execute(
            "INSERT OR IGNORE INTO search VALUES (?, ?, ?, ?, ?, ?)",
            (search, system, map, wanted, job, kind),
        )

    def job(self, search: str) -> str | None:
        """Return the job of a search, or None if there is no such search."""
        row = self.database.execute("SELECT job FROM search WHERE id = ?", (search,)).fetchone()
        return None if row is None else str(row[0])

    def searches(self) -> list[tuple[str, str]]:
        """Return (id, job) of each search."""
        rows = self.database.execute(
            "SELECT id, job FROM search WHERE kind = 'search' ORDER BY system, map, id"
        )
        return rows.fetchall()

    def add_slots(
        self,
        search: str,
        generation: int,
        scenarios: Mapping[int, str],
        earlier_exits: str = "",
        priority: int = 0,
    ) -> None:
        """Add a generation's slots; raise LedgerError if they are there with other scenarios.

        ``earlier_exits`` says how earlier flights of the slots ended, as in a Claim.  Slots of a
        higher ``priority`` fly earlier.
        """
        with self.database.transaction():
            self.database.executemany(
                "INSERT OR IGNORE INTO slot (search, generation, slot, scenario, after, priority) "
                "VALUES (?, ?, ?, ?, ?, ?)",
                [
                    (search, generation, slot, text, earlier_exits, priority)
                    for slot, text in scenarios.items()
                ],
            )
            rows = self.database.execute(
                "SELECT slot, scenario FROM slot WHERE search = ? AND generation = ?",
                (search, generation),
            ).fetchall()
        if any(scenarios.get(slot, text) != text for slot, text in rows):
            raise LedgerError(
                f"{self.path}: generation {generation} was bred in another way before; run without "
                "--garl-resume to start over"
            )

    def generation(self, search: str, generation: int) -> list[tuple[str, FlightResult | None]]:
        """Return (scenario, result or None) of a generation's slots in order."""
        rows = self.database.execute(
            "SELECT scenario, result FROM slot WHERE search = ? AND generation = ? ORDER BY slot",
            (search, generation),
        )
        return [(text, None if result is None else parse_result(result)) for text, result in rows]

    def note_objectives(
        self, search: str, generation: int, objectives: Sequence[Sequence[float]]
    ) -> None:
        """Set the objectives of a generation's slots, in order."""
        with self.database.transaction():
            self.database.executemany(
                "UPDATE slot SET objectives = ? WHERE search = ? AND generation = ? AND slot = ?",
                [
                    (json.dumps(list(values)), search, generation, slot)
                    for slot, values in enumerate(objectives)
                ],
            )

    def add_flight(
        self,
        flight: FlightId,
        system: str,
        job: str,
        scenario: str,
        earlier_exits: str = "",
        priority: int = 0,
    ) -> None:
        """Add one flight on demand, as a search of its own, unless it is there already."""
        self.add_search(flight.search, system, flight.map, 1, job, "on_demand")
        slot, texts = flight.slot, {flight.slot.index: scenario}
        self.add_slots(flight.search, slot.generation, texts, earlier_exits, priority)

    def completed(self, flight: FlightId, folder: Path) -> CompletedFlight | None:
        """Return a flight whose record is in a folder, or None if it has no result."""
        row = self.database.execute(
            "SELECT result, coalesce(sha256, '') FROM slot "
            "WHERE search = ? AND generation = ? AND slot = ?",
            flight.key,
        ).fetchone()
        if row is None or row[0] is None:
            self._check_file()
            return None
        return CompletedFlight(
            result=parse_result(row[0]), sha256=row[1], record=flight.record(folder)
        )

    def _check_file(self) -> None:
        """Raise LedgerError if somebody emptied the file: no result would ever be read from it."""
        try:
            size = self.path.stat().st_size
        except OSError as error:
            raise LedgerError(f"{self.path}: {error.strerror}. {REMEDY}") from error
        if size == 0:
            raise LedgerError(f"{self.path}: somebody emptied this file. {REMEDY}")

    def scenario(self, flight: FlightId) -> str | None:
        """Return a slot's scenario, or None if it is not bred."""
        row = self.database.execute(
            "SELECT scenario FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            flight.key,
        ).fetchone()
        return None if row is None else str(row[0])
