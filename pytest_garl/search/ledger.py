"""The ledger: one SQLite file that holds a run's truth and hands out its work."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError

SCHEMA = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE search (
    id TEXT PRIMARY KEY, system TEXT NOT NULL, map TEXT NOT NULL, budget INTEGER NOT NULL,
    job TEXT NOT NULL
);
CREATE TABLE slot (
    search TEXT NOT NULL, generation INTEGER NOT NULL, slot INTEGER NOT NULL,
    scenario TEXT NOT NULL, state TEXT NOT NULL DEFAULT 'waiting', pid INTEGER,
    attempts INTEGER NOT NULL DEFAULT 0, result TEXT, sha256 TEXT, wall_s REAL,
    PRIMARY KEY (search, generation, slot)
);
CREATE TABLE seat (pid INTEGER PRIMARY KEY);
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One slot that this process shall fly; ``alone`` after it hung once."""

    search: str
    generation: int
    slot: int
    scenario: str
    job: str
    alone: bool


class Ledger:
    """A run's searches, slots and results; safe for several processes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._db = sqlite3.connect(path, timeout=30, isolation_level=None)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
        except sqlite3.Error as error:
            raise LedgerError(f"{path}: cannot be opened as a ledger: {error}") from error

    @classmethod
    def create(cls, path: Path, run: dict[str, Any]) -> Ledger:
        """Begin a new run; an older ledger at the same place is replaced."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            for suffix in ("", "-wal", "-shm"):
                path.with_name(path.name + suffix).unlink(missing_ok=True)
            ledger = cls(path)
            ledger._db.executescript(SCHEMA)
        except (OSError, sqlite3.Error) as error:
            raise LedgerError(
                f"{path}: cannot be written ({error}); choose another folder with the ini key "
                "garl_dir"
            ) from error
        rows = [(key, json.dumps(value)) for key, value in sorted(run.items())]
        ledger._db.executemany("INSERT INTO run VALUES (?, ?)", rows)
        return ledger

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Hold the write lock over several statements."""
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._db.execute("ROLLBACK")
            raise
        self._db.execute("COMMIT")

    def fact(self, key: str) -> Any:
        """Return a fact about the run, or None."""
        row = self._db.execute("SELECT value FROM run WHERE key = ?", (key,)).fetchone()
        return None if row is None else json.loads(row[0])

    def add_search(
        self,
        search: str,
        system: str,
        map: str,
        budget: int,
        job: str,
        rows: Sequence[tuple[int, int, str]],
    ) -> None:
        """Register a search with its (generation, slot, scenario) rows; once is enough."""
        with self.transaction():
            self._db.execute(
                "INSERT OR IGNORE INTO search VALUES (?, ?, ?, ?, ?)",
                (search, system, map, budget, job),
            )
            self._db.executemany(
                "INSERT OR IGNORE INTO slot (search, generation, slot, scenario) "
                "VALUES (?, ?, ?, ?)",
                [(search, *row) for row in rows],
            )

    def claim(self) -> Claim | None:
        """Take the next unflown slot; one that hung is handed out while nobody else flies."""
        with self.transaction():
            flying, alone = self._db.execute(
                "SELECT count(*), coalesce(sum(attempts > 1), 0) FROM slot WHERE state = 'claimed'"
            ).fetchone()
            if alone:
                return None
            row = self._db.execute(
                "SELECT search, generation, slot, scenario, state FROM slot "
                "WHERE state = 'hung' OR state = 'waiting' "
                "ORDER BY state, generation, slot, search LIMIT 1"
            ).fetchone()
            if row is None or (row[4] == "hung" and flying):
                return None
            self._db.execute(
                "UPDATE slot SET state = 'claimed', pid = ?, attempts = attempts + 1 "
                "WHERE search = ? AND generation = ? AND slot = ?",
                (os.getpid(), *row[:3]),
            )
            job = self._db.execute("SELECT job FROM search WHERE id = ?", row[:1]).fetchone()[0]
        return Claim(
            search=row[0],
            generation=row[1],
            slot=row[2],
            scenario=row[3],
            job=job,
            alone=row[4] == "hung",
        )

    def record(self, claim: Claim, result: dict[str, Any], sha256: str, wall_s: float) -> None:
        """Write down what a flight came to."""
        self._db.execute(
            "UPDATE slot SET state = 'flown', pid = NULL, result = ?, sha256 = ?, wall_s = ? "
            "WHERE search = ? AND generation = ? AND slot = ? AND state = 'claimed'",
            (
                json.dumps(result, sort_keys=True, allow_nan=False),
                sha256,
                wall_s,
                claim.search,
                claim.generation,
                claim.slot,
            ),
        )

    def claim_of(self, pid: int) -> tuple[Claim, int] | None:
        """Return the slot that a process has in flight, and which attempt it is."""
        row = self._db.execute(
            "SELECT s.search, generation, slot, scenario, job, attempts FROM slot s "
            "JOIN search ON search.id = s.search WHERE pid = ? AND state = 'claimed'",
            (pid,),
        ).fetchone()
        if row is None:
            return None
        claim = Claim(
            search=row[0],
            generation=row[1],
            slot=row[2],
            scenario=row[3],
            job=row[4],
            alone=row[5] > 1,
        )
        return claim, row[5]

    def release(self, pid: int, state: str) -> None:
        """Give back what a dead process had in flight: 'waiting', or 'hung' to fly it alone."""
        self._db.execute(
            "UPDATE slot SET state = ?, pid = NULL, attempts = attempts - (? = 'waiting') "
            "WHERE pid = ? AND state = 'claimed'",
            (state, state, pid),
        )

    def result(self, search: str, generation: int, slot: int) -> dict[str, Any] | None:
        """Return a flown slot's result, or None."""
        row = self._db.execute(
            "SELECT result FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            (search, generation, slot),
        ).fetchone()
        if row is None or row[0] is None:
            return None
        result: dict[str, Any] = json.loads(row[0])
        return result

    def results(self) -> list[tuple[str, str, int, int, dict[str, Any]]]:
        """Return (system, map, generation, slot, result) of all flown slots in slot order."""
        rows = self._db.execute(
            "SELECT system, map, generation, slot, result FROM slot "
            "JOIN search ON search.id = slot.search WHERE state = 'flown' "
            "ORDER BY system, map, generation, slot"
        )
        return [(*row[:4], json.loads(row[4])) for row in rows]

    def progress(self) -> list[tuple[str, str, int, int]]:
        """Return (system, map, flown, all) per search."""
        return list(
            self._db.execute(
                "SELECT system, map, sum(state = 'flown'), count(*) FROM slot "
                "JOIN search ON search.id = slot.search GROUP BY search.id ORDER BY system, map"
            )
        )

    def violations(self) -> dict[str, int]:
        """Return how often each type of violation was found."""
        rows = self._db.execute(
            "SELECT json_extract(result, '$.verdict.violation_type') AS type, count(*) FROM slot "
            "WHERE state = 'flown' AND type IS NOT NULL GROUP BY type ORDER BY type"
        )
        return dict(rows.fetchall())

    def scenarios(self, generation: int, slot: int, map: str) -> dict[str, str]:
        """Return the scenario of a slot for each system that has one."""
        rows = self._db.execute(
            "SELECT system, scenario FROM slot JOIN search ON search.id = slot.search "
            "WHERE map = ? AND generation = ? AND slot = ?",
            (map, generation, slot),
        )
        return dict(rows.fetchall())

    def result_hash(self) -> str:
        """Return a hash of all results that two equal runs share."""
        digest = hashlib.sha256()
        rows = self._db.execute(
            "SELECT system, map, generation, slot, scenario, result, sha256 FROM slot "
            "JOIN search ON search.id = slot.search ORDER BY system, map, generation, slot"
        )
        for row in rows:
            digest.update(json.dumps(row).encode())
        return digest.hexdigest()

    def seconds_per_flight(self) -> float | None:
        """Return the mean wall time of a flight on one process, if any was flown."""
        row = self._db.execute("SELECT avg(wall_s) FROM slot WHERE state = 'flown'").fetchone()
        return None if row[0] is None else float(row[0])

    def take_seat(self, limit: int, spawn: Any) -> bool:
        """Start a child by ``spawn() -> pid`` unless ``limit`` of them live already."""
        with self.transaction():
            for (pid,) in self._db.execute("SELECT pid FROM seat").fetchall():
                if not _alive(pid):
                    self._db.execute("DELETE FROM seat WHERE pid = ?", (pid,))
            taken = self._db.execute("SELECT count(*) FROM seat").fetchone()[0]
            if taken >= limit:
                return False
            self._db.execute("INSERT INTO seat VALUES (?)", (spawn(),))
        return True

    def leave_seat(self, pid: int) -> None:
        """Free a dead child's seat."""
        self._db.execute("DELETE FROM seat WHERE pid = ?", (pid,))

    def release_dead(self) -> None:
        """Give back the slots of processes that are gone and that nobody else looks after."""
        rows = self._db.execute("SELECT pid FROM slot WHERE state = 'claimed'").fetchall()
        for (pid,) in rows:
            if pid is not None and not _alive(pid):
                time.sleep(0.05)
                self.release(pid, "waiting")


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
