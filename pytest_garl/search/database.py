"""SQLite whose errors are those of the ledger."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError

REMEDY = (
    "Is it a ledger, is there space, may it be written? Mend that and go on with --garl-resume, or "
    "choose another folder with the ini key garl_dir"
)


class Database:
    """A connection whose errors are those of the ledger."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with self._explained():
            self._connection = sqlite3.connect(path, timeout=30, isolation_level=None)

    def execute(self, sql: str, values: Sequence[Any] = ()) -> sqlite3.Cursor:
        """Run one statement."""
        with self._explained():
            return self._connection.execute(sql, values)

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
        except sqlite3.Error as error:
            raise LedgerError(f"{self._path}: {error}. {REMEDY}") from error
