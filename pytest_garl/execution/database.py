"""The SQLite file of a ledger: its tables, its connection, and its errors."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, Literal

from pytest_garl.errors import LedgerError

REMEDY = (
    "Is it a ledger, is there space, may it be written? Fix that and go on with --garl-resume, or "
    "choose another folder with the ini key garl_dir"
)
VERSION = 8
"""Version of the tables below and of the facts in them; a ledger of another version cannot be
resumed."""
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
    priority INTEGER NOT NULL DEFAULT 0,
    result TEXT, objectives TEXT, sha256 TEXT, wall_s REAL,
    PRIMARY KEY (search, generation, slot)
);
CREATE INDEX slot_state ON slot (state, after DESC, priority DESC, generation, slot);
CREATE TABLE worker (pid INTEGER PRIMARY KEY, owner INTEGER NOT NULL);
CREATE TABLE meter (name TEXT PRIMARY KEY, value REAL NOT NULL);
"""
SearchKind = Literal["search", "case", "on_demand"]
"""The purpose of flights: a search's budget, saved cases, or flights on demand, such as a second
flight of a violation.  Figures and the result hash cover the searches alone."""
BEHIND_SEARCHES, BEFORE_SEARCHES = -1, 1
"""Priorities of flights that are flown when no flight of a search waits, and of flights that are
flown before those of searches.  The priority of a search is 0."""
LOCKED_S = 300.0
"""How long a statement waits for another process that holds the ledger's lock.  Ours hold it for
milliseconds; a process that a landing system left behind holds it until its flight ends."""
_BUSY_S = 1.0
"""How long SQLite itself waits; meanwhile no signal is handled."""
_LONGEST = 64_000_000
"""Most bytes of one value: a damaged file may declare a value that fills the memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """The rows that a statement returned, and how many rows it changed."""

    rows: list[tuple[Any, ...]]
    rowcount: int

    def __iter__(self) -> Iterator[tuple[Any, ...]]:
        return iter(self.rows)

    def fetchone(self) -> Any:
        """Return the first row, or None."""
        return self.rows[0] if self.rows else None

    def fetchall(self) -> list[tuple[Any, ...]]:
        """Return all rows."""
        return self.rows


class _Connection(sqlite3.Connection):
    """A connection that closes itself if an error left it open, of which Python 3.13 warns."""

    def __del__(self) -> None:
        with contextlib.suppress(sqlite3.Error):
            self.close()


class Database:
    """A connection to a ledger's file; its errors are LedgerErrors.

    ``on_locked`` is called once a second while another process holds the lock.
    """

    def __init__(self, path: Path, on_locked: Callable[[], None] = lambda: None) -> None:
        self.path, self.on_locked = path, on_locked
        with self._explained():
            self._connection = sqlite3.connect(
                path, timeout=_BUSY_S, isolation_level=None, factory=_Connection
            )
            self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST)
        self.execute("PRAGMA journal_mode=WAL")
        self.execute("PRAGMA synchronous=NORMAL")

    def create_tables(self) -> None:
        """Create the tables of a ledger in an empty file."""
        with self._explained():
            self._connection.executescript(SCHEMA)

    def execute(self, sql: str, values: Sequence[Any] = ()) -> Rows:
        """Run one statement and fetch its rows at once: a damaged page shows only then."""
        until = monotonic() + LOCKED_S
        with self._explained():
            while True:
                try:
                    cursor = self._connection.execute(sql, values)
                    return Rows(rows=cursor.fetchall(), rowcount=cursor.rowcount)
                except sqlite3.OperationalError as error:
                    code = getattr(
                        error, "sqlite_errorcode", 0
                    )  # none if the text cannot be decoded
                    is_busy = code & 0xFF == sqlite3.SQLITE_BUSY
                    if not is_busy or monotonic() > until:
                        raise
                self.on_locked()

    def executemany(self, sql: str, rows: Sequence[Sequence[Any]]) -> None:
        """Run one statement for each row."""
        with self._explained():
            self._connection.executemany(sql, rows)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Hold the write lock over several statements."""
        self.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            with contextlib.suppress(LedgerError):
                self.execute("ROLLBACK")
            raise
        self.execute("COMMIT")

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:
            # The message of SQLite may contain bytes of a damaged file.
            raise LedgerError(f"{self.path}: {error}. {REMEDY}") from error


def set_aside(path: Path) -> None:
    """Rename an older ledger, with its log merged into it, before a new one is created."""
    with contextlib.suppress(sqlite3.Error), contextlib.closing(sqlite3.connect(path)) as old:
        old.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    for suffix in ("-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
    path.replace(path.with_name(f"{path.stem}-previous{path.suffix}"))
