"""Results of finished searches, one row each in a CSV file that is committed."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pytest_garl.files.atomic import locked, write_text_atomically
from pytest_garl.verdicts.verdict import cause_of

SEPARATOR = "|"
"""Separates signatures in a cell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultRow:
    """The results of one search: a system on a map, a method, a seed, a budget.

    ``docs/results/experiments/README.md`` explains each column.  None stands for a value that does
    not exist, such as a tenth violation after only nine.
    """

    system: str
    map: str
    method: str
    seed: int
    budget: int
    violations: int
    type_i: int
    type_ii: int
    type_iii: int
    type_iv: int
    type_v: int
    late: int
    off: int
    hard: int
    aborted: int
    inconclusive: int
    top10: int | None
    signatures: tuple[str, ...]
    parameter_distance: float
    weather_distance: float
    violating_distance: float | None
    covered: int
    cells: int
    flying_s: float
    idle_s: float
    workers: int
    landing_system: str
    landing_system_sha256: str
    map_sha256: str
    policy: str
    policy_sha256: str
    version: str
    package_sha256: str
    domain: str
    engine: str
    machine: str
    result_hash: str
    limits: str
    landed: int
    paper: int
    slid: int
    blocked: int
    excused: int
    needless: int
    kind_counts: tuple[int, ...]
    its_code: int
    its_top10: int | None
    its_covered: int

    @property
    def key(self) -> tuple[str, str, str, int, int, str]:
        """The identity of a search: system, map, method, seed, budget, domain."""
        return self.system, self.map, self.method, self.seed, self.budget, self.domain

    @property
    def causes(self) -> tuple[str, ...]:
        """The distinct types and causes of violations: signatures without phase and sight."""
        return tuple(sorted({cause_of(each) for each in self.signatures}))


_READERS: Mapping[str, Callable[[str], Any]] = MappingProxyType(
    {
        "str": str,
        "int": int,
        "float": float,
        "int | None": lambda cell: int(cell) if cell else None,
        "float | None": lambda cell: float(cell) if cell else None,
        "tuple[int, ...]": lambda cell: tuple(map(int, filter(None, cell.split(SEPARATOR)))),
        "tuple[str, ...]": lambda cell: tuple(filter(None, cell.split(SEPARATOR))),
    }
)
_FIELDS = {field.name: str(field.type) for field in dataclasses.fields(ResultRow)}


def read_rows(path: Path) -> tuple[ResultRow, ...]:
    """Return the rows in a file, or no rows if the file does not exist."""
    if not path.exists():
        return ()
    with path.open(newline="") as file:
        return tuple(
            ResultRow(**{name: _READERS[kind](cells[name]) for name, kind in _FIELDS.items()})
            for cells in csv.DictReader(file)
        )


def append_rows(path: Path, rows: Iterable[ResultRow]) -> None:
    """Add rows to the file; rows that another process has added meanwhile are kept."""
    with locked(path.parent):
        known = read_rows(path)
        keys = {row.key for row in known}
        write_text_atomically(path, _dumps([*known, *(row for row in rows if row.key not in keys)]))


def _dumps(rows: Iterable[ResultRow]) -> str:
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(_FIELDS)
    writer.writerows([_cell(getattr(row, name)) for name in _FIELDS] for row in rows)
    return file.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, tuple):
        return SEPARATOR.join(map(str, value))
    if isinstance(value, float):
        return f"{value:.4f}"
    return "" if value is None else str(value)
