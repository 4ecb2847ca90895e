"""The table of a study: a CSV file that grows while the study runs."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.verdicts.statistics import share_interval

Row = Mapping[str, str]
Key = tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultTable:
    """The CSV file of a study; the values in the ``key`` columns identify a row.

    Columns that an older file lacks are empty in its rows; the next added row adds them.
    """

    file: Path
    columns: tuple[str, ...]
    key: tuple[str, ...]

    def rows(self) -> list[Row]:
        """Return the rows; none if there is no file."""
        empty = dict.fromkeys(self.columns, "")
        return [{**empty, **row} for row in read_csv(self.file)]

    def keys(self) -> set[Key]:
        """Return the keys of all rows."""
        return {tuple(row[name] for name in self.key) for row in self.rows()}

    def append(self, rows: Iterable[Mapping[str, Any]], *, quietly: bool = False) -> None:
        """Add rows at once, so that an interruption loses no finished row, and print them."""
        self._add_columns()
        with self.file.open("a", newline="") as file:
            writer = csv.DictWriter(file, self.columns, lineterminator="\n")
            for row in rows:
                writer.writerow(row)
                if not quietly:
                    print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)

    def _add_columns(self) -> None:
        """Write the header of all columns, and the rows that are there below it."""
        header = ",".join(self.columns)
        if self.file.exists() and self.file.read_text().splitlines()[:1] == [header]:
            return
        rows = self.rows()
        with self.file.open("w", newline="") as file:
            writer = csv.DictWriter(file, self.columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    def fly_missing(
        self,
        keys: Iterable[Key],
        row_of: Callable[[Key, Executor], Mapping[str, Any]],
        workers: int | None = None,
    ) -> None:
        """Append a row for each key without one; ``row_of`` flies in the executor's processes.

        They are new ones: a copy of this process has loaded its libraries for this CPU.
        """
        known = self.keys()
        with ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=cpu_dispatch.check
        ) as pool:
            for key in keys:
                if key not in known:
                    self.append([row_of(key, pool)])


def read_csv(path: Path) -> list[Row]:
    """Return the rows of a CSV file; none if there is no file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def share(count: int, total: int) -> str:
    """Return a percentage with its exact 95 % interval."""
    low, high = share_interval(count, total)
    return f"{100 * count / total:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
