"""The work queue of a ledger: processes claim slots in it, fly them and record the results."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from pytest_garl.execution.database import Database
from pytest_garl.execution.facts import Facts
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.result import FlightResult
from pytest_garl.process_tree import alive

_METERS = {"search": "flights", "case": "cases", "on_demand": "on_demand"}
_NEXT, _NEXT_OF_SYSTEM = (
    "SELECT search, generation, slot, scenario, after, attempts FROM slot "
    f"WHERE state = 'waiting' {condition} ORDER BY after DESC, priority DESC, generation, "
    "slot, search"
    for condition in ("", "AND search IN (SELECT id FROM search WHERE system = ?)")
)
LEASE_S = 30.0
"""How long a claim stays if only one of two processes lives: the one that claimed the slot, or the
pool that watches it.  A process that nobody watches may be another with the same id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """One slot that the process ``pid`` flies, or has another process fly.

    ``earlier_exits`` says how earlier flights of the slot ended their workers, such as "hung" or
    "hung killed"; if it is set, no other slot flies meanwhile.  ``attempt`` counts from 1.
    """

    flight: FlightId
    scenario: str
    job: str
    earlier_exits: str
    attempt: int
    pid: int


class WorkQueue:
    """The slots that wait for a flight, and those that processes have claimed.

    Slots are claimed for the process ``pid``: this one, or its supervisor.
    """

    def __init__(self, database: Database, pid: int | None = None) -> None:
        self.path = database.path
        self._database = database
        self._pid = os.getpid() if pid is None else pid

    @classmethod
    def open(
        cls, path: Path, pid: int | None = None, on_locked: Callable[[], None] = lambda: None
    ) -> WorkQueue:
        """Open the queue of the ledger at ``path`` alone, as a worker does.

        ``on_locked`` is called once a second while another process holds the ledger's lock.
        """
        return cls(Database(path, on_locked), pid)

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    @contextmanager
    def when_locked(self, do: Callable[[], None]) -> Iterator[None]:
        """Call ``do`` once a second while another process holds the ledger's lock."""
        before, self._database.on_locked = self._database.on_locked, do
        try:
            yield
        finally:
            self._database.on_locked = before

    def claim(self, lease_s: float | None = LEASE_S, *, flown: str = "") -> Claim | None:
        """Claim the next slot; a slot that ended a worker is claimed only while no other flies.

        ``flown`` names the landing system that this process has flown; it then gets slots of this
        system alone, and none that ended a worker.  ``lease_s`` is the lease of the claim, as in
        ``release_dead``; with None the claim lasts as long as the process.
        """
        with self._database.transaction():
            flying, alone = self._database.execute(
                "SELECT count(*), coalesce(sum(after != ''), 0) FROM slot WHERE state = 'claimed'"
            ).fetchone()
            if alone:
                return None
            row = self._database.execute(f"{_NEXT} LIMIT 1").fetchone()
            if row and flown and not row[4]:
                row = self._database.execute(f"{_NEXT_OF_SYSTEM} LIMIT 1", (flown,)).fetchone()
            if row is None or (row[4] and (flying or flown)):
                return None
            self._database.execute(
                "UPDATE slot SET state = 'claimed', pid = ?, lease = ?, attempts = attempts + 1 "
                "WHERE search = ? AND generation = ? AND slot = ?",
                (self._pid, None if lease_s is None else monotonic() + lease_s, *row[:3]),
            )
            job, map = self._database.execute(
                "SELECT job, map FROM search WHERE id = ?", row[:1]
            ).fetchone()
        director = Facts(self._database, self.path).director(row[0], row[1])
        return Claim(
            flight=FlightId(search=row[0], map=map, slot=Slot(generation=row[1], index=row[2])),
            scenario=row[3],
            job=parse_job(job).directed_by(director).dumps() if director else job,
            earlier_exits=row[4],
            attempt=row[5] + 1,
            pid=self._pid,
        )

    def others_wait(self, flown: str) -> bool:
        """Return whether slots wait, but none of the landing system ``flown``."""
        own, others = self._database.execute(
            "SELECT coalesce(sum(system = ?), 0), coalesce(sum(system != ?), 0) "
            "FROM slot JOIN search ON search.id = slot.search WHERE state = 'waiting'",
            (flown, flown),
        ).fetchone()
        return bool(others) and not own

    def alone_waits(self) -> bool:
        """Return whether no slot flies, and one waits that a fresh process must fly alone."""
        flying, waiting = self._database.execute(
            "SELECT coalesce(sum(state = 'claimed'), 0), coalesce(sum(after != ''), 0) FROM slot "
            "WHERE state IN ('claimed', 'waiting')"
        ).fetchone()
        return not flying and bool(waiting)

    def waiting(self) -> int:
        """Return how many slots wait."""
        row = self._database.execute("SELECT count(*) FROM slot WHERE state = 'waiting'").fetchone()
        return int(row[0])

    def record(self, claim: Claim, result: FlightResult, sha256: str, wall_s: float) -> None:
        """Record the result of a flight; a slot that has a result keeps it."""
        text = result.dumps()
        with self._database.transaction():
            done = self._database.execute(
                "UPDATE slot SET state = 'flown', pid = NULL, lease = NULL, "
                "result = ?, sha256 = ?, wall_s = ? "
                "WHERE search = ? AND generation = ? AND slot = ? AND state = 'claimed'",
                (text, sha256, wall_s, *claim.flight.key),
            )
            if done.rowcount:
                kind = self._database.execute(
                    "SELECT kind FROM search WHERE id = ?", (claim.flight.search,)
                ).fetchone()[0]
                self.count(_METERS[kind])
                self.count("flying_s", wall_s)

    def claim_of(self, pid: int) -> Claim | None:
        """Return the claim of a process, which may have ended; None if it has none."""
        row = self._database.execute(
            "SELECT s.search, generation, slot, scenario, job, after, attempts, map FROM slot s "
            "JOIN search ON search.id = s.search WHERE pid = ? AND state = 'claimed'",
            (pid,),
        ).fetchone()
        if row is None:
            return None
        return Claim(
            flight=FlightId(search=row[0], map=row[7], slot=Slot(generation=row[1], index=row[2])),
            scenario=row[3],
            job=row[4],
            earlier_exits=row[5],
            attempt=row[6],
            pid=pid,
        )

    def release(self, pid: int) -> None:
        """Give back all slots of a process; the claims do not count."""
        self._database.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, "
            "attempts = attempts - 1 WHERE pid = ? AND state = 'claimed'",
            (pid,),
        )

    def give_back(self, claim: Claim) -> None:
        """Give back one slot; the claim does not count."""
        self._hand_out(claim, claim.attempt - 1, claim.earlier_exits)

    def fly_alone(self, claim: Claim, earlier_exits: str) -> None:
        """Have a slot flown once more, alone; ``earlier_exits`` says how its flights ended."""
        self._hand_out(claim, claim.attempt, earlier_exits)

    def _hand_out(self, claim: Claim, attempts: int, earlier_exits: str) -> None:
        self._database.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, attempts = ?, after = ? "
            "WHERE search = ? AND generation = ? AND slot = ? AND state = 'claimed' AND pid = ?",
            (attempts, earlier_exits, *claim.flight.key, claim.pid),
        )

    def reset(self) -> None:
        """Give back all claimed slots; no process may be flying."""
        self._database.execute("DELETE FROM worker")
        self._database.execute(
            "UPDATE slot SET state = 'waiting', pid = NULL, lease = NULL, "
            "attempts = max(0, attempts - 1) WHERE state = 'claimed'"
        )

    def release_dead(self) -> None:
        """Give back the slots of workers that have ended together with their pools.

        If a worker has ended and its pool lives, the pool has until the end of the lease to decide
        on the slot.  A worker that lives needs no limit: its supervisor ends it if it hangs.
        """
        rows = self._database.execute(
            "SELECT slot.pid, lease, owner FROM slot LEFT JOIN worker ON worker.pid = slot.pid "
            "WHERE state = 'claimed'"
        ).fetchall()
        for pid, lease, owner in rows:
            lapsed = lease is not None and lease < monotonic()
            flies, watched = alive(pid), owner is not None and alive(owner)
            if not (flies or watched) or (lapsed and not (flies and watched)):
                self.release(pid)

    def register_worker(self, limit: int, spawn: Callable[[], int]) -> bool:
        """Start a worker by ``spawn``, which returns its id, unless ``limit`` workers live."""
        with self._database.transaction():
            for pid, owner in self._database.execute("SELECT pid, owner FROM worker").fetchall():
                if not alive(pid) and not alive(owner):
                    self._database.execute("DELETE FROM worker WHERE pid = ?", (pid,))
            living = self._database.execute("SELECT count(*) FROM worker").fetchone()[0]
            if living >= limit:
                return False
            self._database.execute("INSERT INTO worker VALUES (?, ?)", (spawn(), os.getpid()))
        return True

    def unregister_worker(self, pid: int) -> None:
        """Remove a worker that has ended, so that another one may start."""
        self._database.execute("DELETE FROM worker WHERE pid = ?", (pid,))

    def count(self, meter: str, amount: float = 1.0) -> None:
        """Add to a meter of what the run spent."""
        self._database.execute(
            "INSERT INTO meter VALUES (?, ?) "
            "ON CONFLICT (name) DO UPDATE SET value = value + excluded.value",
            (meter, amount),
        )

    def flights(self) -> float:
        """Return how many flights have ended, of searches, cases and on demand."""
        row = self._database.execute(
            "SELECT coalesce(sum(value), 0) FROM meter WHERE name IN (?, ?, ?)",
            tuple(_METERS.values()),
        ).fetchone()
        return float(row[0])
