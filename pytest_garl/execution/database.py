"""SQLite whose errors are those of the ledger."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError

REMEDY = (
    "Is it a ledger, is there space, may it be written? Fix that and go on with --garl-resume, or "
    "choose another folder with the ini key garl_dir"
)
_LONGEST = 64_000_000
"""Bytes in one value: a damaged file may say that one fills the memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """What a statement returned, and how many rows it changed."""

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


class Database:
    """A connection whose errors are those of the ledger."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._explained():
            self._connection = sqlite3.connect(path, timeout=30, isolation_level=None)
            self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST)

    def execute(self, sql: str, values: Sequence[Any] = ()) -> Rows:
        """Run one statement and fetch what it returns: a damaged page may show only then."""
        with self._explained():
            cursor = self._connection.execute(sql, values)
            return Rows(rows=cursor.fetchall(), rowcount=cursor.rowcount)

    def executemany(self, sql: str, rows: Sequence[Sequence[Any]]) -> None:
        """Run one statement for each row."""
        with self._explained():
            self._connection.executemany(sql, rows)

    def executescript(self, sql: str) -> None:
        """Run several statements."""
        with self._explained():
            self._connection.executescript(sql)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:
            # What SQLite says of a damaged file may hold bytes of it.
            raise LedgerError(f"{self._path}: {error}. {REMEDY}") from error
