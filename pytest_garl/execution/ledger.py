"""The ledger: one SQLite file that holds a run's truth and hands out its work."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Literal

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import REMEDY, Database
from pytest_garl.execution.processes import alive
from pytest_garl.execution.slot import Slot
from pytest_garl.files.json_values import parsed
from pytest_garl.messages import printable, shortened, shown

VERSION = 4
"""Of the tables below; a ledger of another version is not continued."""
SCHEMA = """
CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE search (
    id TEXT PRIMARY KEY, system TEXT NOT NULL, map TEXT NOT NULL, wanted INTEGER NOT NULL,
    job TEXT NOT NULL, kind TEXT NOT NULL DEFAULT 'search'
);
CREATE TABLE slot (
    search TEXT NOT NULL, generation INTEGER NOT NULL, slot INTEGER NOT NULL,
    scenario TEXT NOT NULL, state TEXT NOT NULL DEFAULT 'waiting', pid INTEGER, lease REAL,
    attempts INTEGER NOT NULL DEFAULT 0, after TEXT NOT NULL DEFAULT '',
    result TEXT, objectives TEXT, sha256 TEXT, wall_s REAL,
    PRIMARY KEY (search, generation, slot)
);
CREATE INDEX slot_state ON slot (state, after DESC, generation, slot);
CREATE TABLE seat (pid INTEGER PRIMARY KEY, owner INTEGER NOT NULL);
CREATE TABLE meter (name TEXT PRIMARY KEY, value REAL NOT NULL);
"""
Kind = Literal["search", "case", "errand"]
"""What flights are for: a search's budget, saved cases, or something beside them, such as flying a
violation once more.  Figures and the result hash are those of the searches."""
_METERS = {"search": "flights", "case": "cases", "errand": "errands"}
_NEXT, _NEXT_OF_SYSTEM = (
    "SELECT search, generation, slot, scenario, after, attempts FROM slot "
    f"WHERE state = 'waiting' {condition} ORDER BY after DESC, generation, slot, search"
    for condition in ("", "AND search IN (SELECT id FROM search WHERE system = ?)")
)
_ADDRESS = re.compile(r"0x[0-9a-f]+")
LEASE_S = 30.0
"""So long the claim of a dead process is left to those who watched it, and that of a living one to
it where nobody watches: its id was given to another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One slot that the process ``pid`` shall fly, or see to it that it is flown.

    ``after`` is how earlier flights of it ended their processes, such as "hung" or "hung killed";
    then it is flown once more, alone.  ``attempt`` counts from 1.
    """

    search: str
    generation: int
    slot: int
    scenario: str
    job: str
    after: str
    attempt: int
    pid: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a search is: slots flown of all, and the latest generation bred."""

    system: str
    map: str
    flown: int
    all: int
    generation: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A flown slot."""

    search: str
    generation: int
    slot: int
    scenario: str
    result: dict[str, Any]
    sha256: str

    @property
    def signature(self) -> str:
        """The violation's signature."""
        return str(self.result["verdict"]["signature"])


class Ledger:
    """A run's searches, slots and results; safe for several processes.

    Slots are claimed for the process ``pid``: this one, or the one that watches it.
    """

    def __init__(self, path: Path, pid: int | None = None) -> None:
        self.path = path
        self._pid = os.getpid() if pid is None else pid
        self._db = Database(path)
        self._db.execute("PRAGMA journal_mode=WAL")
        self._db.execute("PRAGMA synchronous=NORMAL")

    @classmethod
    def create(cls, path: Path, run: Mapping[str, Any]) -> Ledger:
        """Begin a new run; an older ledger at the same place is kept as ``previous``."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.is_file():
                _set_aside(path)
        except OSError as error:
            raise LedgerError(f"{path}: {error.strerror}. {REMEDY}") from error
        ledger = cls(path)
        ledger._db.executescript(SCHEMA)
        facts = {**run, "ledger": VERSION}
        rows = [(key, json.dumps(value)) for key, value in sorted(facts.items())]
        ledger._db.executemany("INSERT INTO run VALUES (?, ?)", rows)
        return ledger

    @classmethod
    def resume(cls, path: Path, run: Mapping[str, Any]) -> Ledger:
        """Continue an interrupted run; raise LedgerError if it was another one.

        Nobody else may be using it: what was in flight is given back.
        """
        if not path.is_file():
            raise LedgerError(f"--garl-resume: there is no ledger at {path}; run without it first")
        try:
            ledger = cls(path)
            version = ledger.fact("ledger")
            problem = ledger._db.execute("PRAGMA quick_check").fetchone()[0]
        except LedgerError as error:
            problem, version = str(error.__cause__ or error), VERSION
        if problem != "ok":
            raise LedgerError(
                f"--garl-resume: {path} is damaged or no ledger ({problem}); run without "
                "--garl-resume to begin anew"
            )
        wanted = {**run, "ledger": VERSION}
        found = {"ledger": version, **{key: ledger.fact(key) for key in run}}
        differing = [key for key in wanted if wanted[key] != found[key]]
        if differing:
            facts = "; ".join(
                f"{key} was {shortened(str(found[key]))}, is {wanted[key]}" for key in differing
            )
            raise LedgerError(
                f"--garl-resume: {path} belongs to another run: {facts}. Give the same options, or "
                "run without --garl-resume to begin anew"
            )
        ledger._db.execute("DELETE FROM seat")
        # What the tests of the interrupted run told of is told again.
        ledger._db.execute("DELETE FROM run WHERE key LIKE 'told %'")
        ledger._db.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, "
            "attempts = max(0, attempts - 1) WHERE state = 'claimed'"
        )
        return ledger

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    def remove(self) -> None:
        """Remove the closed file and those beside it: nobody will ask for it again."""
        for suffix in ("", "-wal", "-shm"):
            self.path.with_name(self.path.name + suffix).unlink(missing_ok=True)
        self.path.with_suffix(".lock").unlink(missing_ok=True)

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Hold the write lock over several statements."""
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            with contextlib.suppress(LedgerError):
                self._db.execute("ROLLBACK")
            raise
        self._db.execute("COMMIT")

    def note_fact(self, key: str, value: Any) -> None:
        """Write down a fact about the run."""
        self._db.execute("INSERT OR REPLACE INTO run VALUES (?, ?)", (key, json.dumps(value)))

    def fact(self, key: str) -> Any:
        """Return a fact about the run, or None."""
        row = self._db.execute("SELECT value FROM run WHERE key = ?", (key,)).fetchone()
        try:
            return None if row is None else parsed(row[0])
        except ValueError as error:
            raise LedgerError(f"{self.path}: the fact {key!r} is damaged: {error}") from error

    def select(self, sql: str) -> list[tuple[Any, ...]]:
        """Return what a query finds, as it is stored."""
        return self._db.execute(sql).fetchall()

    def first_fact(self, key: str, value: Any) -> Any:
        """Write down a fact unless there is one already; return the one that stands."""
        self._db.execute("INSERT OR IGNORE INTO run VALUES (?, ?)", (key, json.dumps(value)))
        return self.fact(key)

    def add_search(
        self, search: str, system: str, map: str, wanted: int, job: str, kind: Kind = "search"
    ) -> None:
        """Register a search that will fly ``wanted`` slots; once is enough."""
        self._db.execute(
            "INSERT OR IGNORE INTO search VALUES (?, ?, ?, ?, ?, ?)",
            (search, system, map, wanted, job, kind),
        )

    def job(self, search: str) -> str | None:
        """Return what was registered for a search, or None."""
        row = self._db.execute("SELECT job FROM search WHERE id = ?", (search,)).fetchone()
        return None if row is None else str(row[0])

    def add_slots(
        self, search: str, generation: int, scenarios: Mapping[int, str], after: str = ""
    ) -> None:
        """Hand out a generation's slots; once is enough, and twice must be the same.

        ``after`` is how earlier flights of them ended their processes, as in a Claim.
        """
        with self.transaction():
            self._db.executemany(
                "INSERT OR IGNORE INTO slot (search, generation, slot, scenario, after) "
                "VALUES (?, ?, ?, ?, ?)",
                [(search, generation, slot, text, after) for slot, text in scenarios.items()],
            )
            rows = self._db.execute(
                "SELECT slot, scenario FROM slot WHERE search = ? AND generation = ?",
                (search, generation),
            ).fetchall()
        if any(scenarios.get(slot, text) != text for slot, text in rows):
            raise LedgerError(
                f"{self.path}: generation {generation} was bred in another way before; run without "
                "--garl-resume to begin anew"
            )

    def generation(self, search: str, generation: int) -> list[tuple[str, dict[str, Any] | None]]:
        """Return (scenario, result or None) of a generation's slots in order."""
        rows = self._db.execute(
            "SELECT scenario, result FROM slot WHERE search = ? AND generation = ? ORDER BY slot",
            (search, generation),
        )
        return [(text, None if result is None else result_in(result)) for text, result in rows]

    def unflown(self, search: str, generation: int) -> int:
        """Return how many of a generation's slots have no result yet."""
        row = self._db.execute(
            "SELECT count(*) FROM slot WHERE search = ? AND generation = ? AND result IS NULL",
            (search, generation),
        ).fetchone()
        return int(row[0])

    def note_objectives(
        self, search: str, generation: int, objectives: Sequence[Sequence[float]]
    ) -> None:
        """Write down a generation's objectives, slot by slot."""
        with self.transaction():
            self._db.executemany(
                "UPDATE slot SET objectives = ? WHERE search = ? AND generation = ? AND slot = ?",
                [
                    (json.dumps(list(values)), search, generation, slot)
                    for slot, values in enumerate(objectives)
                ],
            )

    def claim(self, lease_s: float | None = LEASE_S, *, flown: str = "") -> Claim | None:
        """Take the next unflown slot; one that ended its process is handed out while nobody flies.

        ``flown`` names the landing system that this process has flown: it gets slots of that one
        alone, and none that ended a process.  ``lease_s`` is how long the claim is kept as in
        ``release_dead``; None: while the process lives.
        """
        with self.transaction():
            flying, alone = self._db.execute(
                "SELECT count(*), coalesce(sum(after != ''), 0) FROM slot WHERE state = 'claimed'"
            ).fetchone()
            if alone:
                return None
            row = self._db.execute(f"{_NEXT} LIMIT 1").fetchone()
            if row and flown and not row[4]:
                row = self._db.execute(f"{_NEXT_OF_SYSTEM} LIMIT 1", (flown,)).fetchone()
            if row is None or (row[4] and (flying or flown)):
                return None
            self._db.execute(
                "UPDATE slot SET state = 'claimed', pid = ?, lease = ?, attempts = attempts + 1 "
                "WHERE search = ? AND generation = ? AND slot = ?",
                (self._pid, None if lease_s is None else monotonic() + lease_s, *row[:3]),
            )
            job = self._db.execute("SELECT job FROM search WHERE id = ?", row[:1]).fetchone()[0]
        return Claim(
            search=row[0],
            generation=row[1],
            slot=row[2],
            scenario=row[3],
            job=job,
            after=row[4],
            attempt=row[5] + 1,
            pid=self._pid,
        )

    def others_wait(self, flown: str) -> bool:
        """Return whether slots wait, but none of the system that a process has flown."""
        own, others = self._db.execute(
            "SELECT coalesce(sum(system = ?), 0), coalesce(sum(system != ?), 0) "
            "FROM slot JOIN search ON search.id = slot.search WHERE state = 'waiting'",
            (flown, flown),
        ).fetchone()
        return bool(others) and not own

    def alone_waits(self) -> bool:
        """Return whether nobody flies and a slot waits for a fresh process to fly it alone."""
        flying, waiting = self._db.execute(
            "SELECT coalesce(sum(state = 'claimed'), 0), coalesce(sum(after != ''), 0) FROM slot "
            "WHERE state IN ('claimed', 'waiting')"
        ).fetchone()
        return not flying and bool(waiting)

    def count(self, meter: str, amount: float = 1.0) -> None:
        """Add to a meter: what the run spent, beside its results."""
        self._db.execute(
            "INSERT INTO meter VALUES (?, ?) "
            "ON CONFLICT (name) DO UPDATE SET value = value + excluded.value",
            (meter, amount),
        )

    def meters(self) -> dict[str, float]:
        """Return what the run spent so far."""
        return dict(self._db.execute("SELECT name, value FROM meter ORDER BY name").fetchall())

    def flights(self) -> float:
        """Return how many flights came to their end, whatever they were for."""
        meters = self.meters()
        return sum(meters.get(name, 0.0) for name in _METERS.values())

    def record(self, claim: Claim, result: dict[str, Any], sha256: str, wall_s: float) -> None:
        """Write down what a flight came to; a slot that has a result keeps it."""
        text = json.dumps(result, sort_keys=True, allow_nan=False)
        with self.transaction():
            done = self._db.execute(
                "UPDATE slot SET state = 'flown', pid = NULL, lease = NULL, "
                "result = ?, sha256 = ?, wall_s = ? "
                "WHERE search = ? AND generation = ? AND slot = ? AND state = 'claimed'",
                (text, sha256, wall_s, claim.search, claim.generation, claim.slot),
            )
            if done.rowcount:
                kind = self._db.execute(
                    "SELECT kind FROM search WHERE id = ?", (claim.search,)
                ).fetchone()[0]
                self.count(_METERS[kind])
                self.count("flying_s", wall_s)

    def claim_of(self, pid: int) -> Claim | None:
        """Return the slot that a process has in flight; it may be gone by then."""
        row = self._db.execute(
            "SELECT s.search, generation, slot, scenario, job, after, attempts FROM slot s "
            "JOIN search ON search.id = s.search WHERE pid = ? AND state = 'claimed'",
            (pid,),
        ).fetchone()
        if row is None:
            return None
        return Claim(
            search=row[0],
            generation=row[1],
            slot=row[2],
            scenario=row[3],
            job=row[4],
            after=row[5],
            attempt=row[6],
            pid=pid,
        )

    def release(self, pid: int) -> None:
        """Give back all that a process has in flight, as if it had not been claimed."""
        self._db.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, "
            "attempts = attempts - 1 WHERE pid = ? AND state = 'claimed'",
            (pid,),
        )

    def give_back(self, claim: Claim) -> None:
        """Give back one slot, as if it had not been claimed."""
        self._hand_out(claim, claim.attempt - 1, claim.after)

    def fly_alone(self, claim: Claim, after: str) -> None:
        """Hand out a slot once more, when nobody else flies; say how its flights ended."""
        self._hand_out(claim, claim.attempt, after)

    def _hand_out(self, claim: Claim, attempts: int, after: str) -> None:
        self._db.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, attempts = ?, after = ? "
            "WHERE search = ? AND generation = ? AND slot = ? AND state = 'claimed' AND pid = ?",
            (attempts, after, claim.search, claim.generation, claim.slot, claim.pid),
        )

    def result(self, search: str, generation: int, slot: int) -> dict[str, Any] | None:
        """Return a flown slot's result, or None."""
        row = self._db.execute(
            "SELECT result FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            (search, generation, slot),
        ).fetchone()
        if row is None or row[0] is None:
            return None
        return result_in(row[0])

    def scenario(self, search: str, generation: int, slot: int) -> str | None:
        """Return a slot's scenario, or None where it has not been bred."""
        row = self._db.execute(
            "SELECT scenario FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            (search, generation, slot),
        ).fetchone()
        return None if row is None else str(row[0])

    def sha256(self, search: str, generation: int, slot: int) -> str:
        """Return the trajectory's hash of a flown slot; empty where its process did not live."""
        row = self._db.execute(
            "SELECT sha256 FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            (search, generation, slot),
        ).fetchone()
        return str(row[0] or "") if row else ""

    def wall_s(self, search: str, generation: int, slot: int) -> float:
        """Return how long a flown slot took; 0 where its process did not live."""
        row = self._db.execute(
            "SELECT wall_s FROM slot WHERE search = ? AND generation = ? AND slot = ?",
            (search, generation, slot),
        ).fetchone()
        return float(row[0] or 0.0) if row else 0.0

    def waiting(self) -> int:
        """Return how many slots could be handed out."""
        row = self._db.execute("SELECT count(*) FROM slot WHERE state = 'waiting'").fetchone()
        return int(row[0])

    def results(self, kind: Kind = "search") -> list[tuple[str, str, int, int, dict[str, Any]]]:
        """Return (system, map, generation, slot, result) of all flown slots in slot order."""
        rows = self._db.execute(
            "SELECT system, map, generation, slot, result FROM slot "
            "JOIN search ON search.id = slot.search WHERE state = 'flown' AND kind = ? "
            "ORDER BY system, map, generation, slot",
            (kind,),
        )
        return [(*row[:4], result_in(row[4])) for row in rows]

    def searches(self) -> list[tuple[str, str]]:
        """Return (id, job) of each search."""
        rows = self._db.execute(
            "SELECT id, job FROM search WHERE kind = 'search' ORDER BY system, map, id"
        )
        return rows.fetchall()

    def progress(self) -> list[Progress]:
        """Return how far each search is."""
        rows = self._db.execute(
            "SELECT system, map, coalesce(sum(state = 'flown'), 0), wanted, "
            "coalesce(max(generation), 0) FROM search "
            "LEFT JOIN slot ON search.id = slot.search WHERE kind = 'search' "
            "GROUP BY search.id ORDER BY system, map"
        )
        return [
            Progress(system=system, map=map, flown=flown, all=wanted, generation=generation)
            for system, map, flown, wanted, generation in rows
        ]

    def violating(self) -> list[Row]:
        """Return the searches' violations in slot order."""
        return self._rows("json_extract(result, '$.verdict.primary') IS NOT NULL")

    def flown(self, search: str) -> list[Row]:
        """Return all flights of a search in slot order."""
        return self._rows("search.id = ?", search)

    def _rows(self, condition: str, *values: str) -> list[Row]:
        rows = self._db.execute(
            "SELECT search, generation, slot, scenario, result, sha256 FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' AND state = 'flown' "
            f"AND {condition} ORDER BY system, map, generation, slot",
            values,
        )
        return [
            Row(
                search=row[0],
                generation=row[1],
                slot=row[2],
                scenario=row[3],
                result=result_in(row[4]),
                sha256=row[5] or "",
            )
            for row in rows
        ]

    def nearest(self) -> dict[str, tuple[float, str]]:
        """Return each property's smallest decided margin so far, with its unit."""
        rows = self._db.execute(
            "SELECT json_extract(m.value, '$.property') AS name, "
            "min(json_extract(m.value, '$.value')), json_extract(m.value, '$.unit') "
            "FROM slot JOIN search ON search.id = slot.search, "
            "json_each(slot.result, '$.verdict.margins') AS m "
            "WHERE kind = 'search' AND state = 'flown' AND json_extract(m.value, '$.decided') "
            "GROUP BY name"
        )
        return {name: (value, unit) for name, value, unit in rows}

    def violations(self) -> dict[str, int]:
        """Return how often each type of violation was found."""
        rows = self._db.execute(
            "SELECT json_extract(result, '$.verdict.violation_type') AS type, count(*) FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' "
            "AND state = 'flown' AND type IS NOT NULL GROUP BY type ORDER BY type"
        )
        return dict(rows.fetchall())

    def flight(self, system: str, map: str, slot: Slot) -> tuple[dict[str, Any], str, str]:
        """Return result, trajectory's hash and scenario of a search's flown slot."""
        row = self._db.execute(
            "SELECT result, coalesce(sha256, ''), scenario FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' AND system = ? "
            "AND map = ? AND generation = ? AND slot = ?",
            (system, map, slot.generation, slot.index),
        ).fetchone()
        return json.loads(row[0]), str(row[1]), str(row[2])

    def kinds(self) -> dict[tuple[str, str], float]:
        """Return the mean wall time of a flight of each kind of violation: search, signature."""
        rows = self._db.execute(
            "SELECT search.id, json_extract(result, '$.verdict.signature') AS signature, "
            "avg(coalesce(wall_s, 0)) FROM slot JOIN search ON search.id = slot.search "
            "WHERE kind = 'search' AND state = 'flown' "
            "AND json_extract(result, '$.verdict.primary') IS NOT NULL "
            "GROUP BY search.id, signature"
        )
        return {(search, signature): float(wall_s) for search, signature, wall_s in rows}

    def scenarios(self, generation: int, slot: int, map: str) -> dict[str, str]:
        """Return the scenario of a slot for each system that has one."""
        rows = self._db.execute(
            "SELECT system, scenario FROM slot JOIN search ON search.id = slot.search "
            "WHERE kind = 'search' AND map = ? AND generation = ? AND slot = ?",
            (map, generation, slot),
        )
        return dict(rows.fetchall())

    def result_hash(self, search: str = "") -> str:
        """Return a hash of all results that two equal runs share, or of one search's."""
        digest = hashlib.sha256()
        rows = self._db.execute(
            "SELECT system, map, generation, slot, scenario, result, objectives, sha256 FROM slot "
            "JOIN search ON search.id = slot.search WHERE kind = 'search' AND ? IN ('', search.id) "
            "ORDER BY system, map, generation, slot",
            (search,),
        )
        for row in rows:
            digest.update(_comparable(row).encode())
        return digest.hexdigest()

    def seconds_per_flight(self) -> float | None:
        """Return the mean wall time of a flight on one process, if any was flown."""
        row = self._db.execute("SELECT avg(wall_s) FROM slot WHERE state = 'flown'").fetchone()
        return None if row[0] is None else float(row[0])

    def flying_s(self, search: str) -> float:
        """Return the wall time of all flights of a search, each on one process."""
        row = self._db.execute(
            "SELECT coalesce(sum(wall_s), 0) FROM slot WHERE search = ?", (search,)
        ).fetchone()
        return float(row[0])

    def take_seat(self, limit: int, spawn: Any) -> bool:
        """Start a child by ``spawn() -> pid`` unless ``limit`` of them live already."""
        with self.transaction():
            for pid, owner in self._db.execute("SELECT pid, owner FROM seat").fetchall():
                if not alive(pid) and not alive(owner):
                    self._db.execute("DELETE FROM seat WHERE pid = ?", (pid,))
            taken = self._db.execute("SELECT count(*) FROM seat").fetchone()[0]
            if taken >= limit:
                return False
            self._db.execute("INSERT INTO seat VALUES (?, ?)", (spawn(), os.getpid()))
        return True

    def leave_seat(self, pid: int) -> None:
        """Free a dead child's seat."""
        self._db.execute("DELETE FROM seat WHERE pid = ?", (pid,))

    def release_dead(self) -> None:
        """Give back the slots of processes that are gone with those who watched them.

        A dead child whose pool lives is left to it for a while: it knows what the death means.
        A living one is never silent: its supervisor ends it where it hangs.
        """
        rows = self._db.execute(
            "SELECT slot.pid, lease, owner FROM slot LEFT JOIN seat ON seat.pid = slot.pid "
            "WHERE state = 'claimed'"
        ).fetchall()
        for pid, lease, owner in rows:
            lapsed = lease is not None and lease < monotonic()
            flies, watched = alive(pid), owner is not None and alive(owner)
            if not (flies or watched) or (lapsed and not (flies and watched)):
                self.release(pid)


def _comparable(row: tuple[Any, ...]) -> str:
    """Return a slot without what differs from run to run and means nothing.

    These are addresses, and where a process was when it was ended.
    """
    *before, result, objectives, sha256 = row
    if result is not None:
        values = json.loads(result)
        if values.get("crash"):
            values["crash"].pop("traceback", None)
        result = json.dumps(values, sort_keys=True)
    return _ADDRESS.sub("0x", json.dumps([*before, result, objectives, sha256]))


def result_in(text: str) -> dict[str, Any]:
    """Return a flight's result; control characters in what a landing system said are written out.

    Raises LedgerError for a text that holds none.
    """
    try:
        result = parsed(text)
    except ValueError as error:
        raise LedgerError(f"a result in the ledger is damaged: {error}. {REMEDY}") from error
    if not isinstance(result, dict):
        raise LedgerError(f"a result in the ledger is damaged: found {shown(result)}. {REMEDY}")
    # JSON escapes all that is no ASCII, control characters too.
    return _seen(result) if "\\u" in text else result


def _seen(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _seen(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_seen(item) for item in value]
    return printable(value) if isinstance(value, str) else value


def _set_aside(path: Path) -> None:
    """Keep one older ledger, whole, before a new one takes its place."""
    with contextlib.suppress(sqlite3.Error), contextlib.closing(sqlite3.connect(path)) as old:
        old.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    for suffix in ("-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
    path.replace(path.with_name(f"{path.stem}-previous{path.suffix}"))
