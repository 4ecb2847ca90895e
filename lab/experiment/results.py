"""Results of finished searches, one row each in a CSV file that is committed."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pytest_garl.errors import ExperimentError
from pytest_garl.files.atomic import locked, write_text_atomically
from pytest_garl.files.bounded_files import MEGABYTE, read_text
from pytest_garl.messages import listed, printable, shown
from pytest_garl.verdicts.verdict import cause_of

LARGEST_BYTES = 16 * MEGABYTE
"""About ten thousand searches, each a row of a kilobyte."""
SEPARATOR = "|"
"""Separates signatures in a cell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultRow:
    """The results of one search: a system on a map, a method, a seed, a budget.

    ``docs/experiments/README.md`` explains each column.  None stands for a value that does not
    exist, such as a tenth violation after only nine.
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

    @property
    def key(self) -> tuple[str, str, str, int, int]:
        """The identity of a search: system, map, method, seed, budget."""
        return self.system, self.map, self.method, self.seed, self.budget

    @property
    def type_counts(self) -> tuple[int, ...]:
        """Violations of the types I to V."""
        return self.type_i, self.type_ii, self.type_iii, self.type_iv, self.type_v

    @property
    def causes(self) -> tuple[str, ...]:
        """The distinct types and causes of violations: signatures without phase and sight."""
        return tuple(sorted({cause_of(each) for each in self.signatures}))


def _number(cell: str) -> float:
    value = float(cell)
    if not math.isfinite(value):
        raise ValueError(cell)
    return value


def _whole_number(cell: str) -> int:
    value = int(cell)
    if not 0 <= value <= _LARGEST:
        raise ValueError(cell)
    return value


_LARGEST = 2**63 - 1


def _optional(kind: Callable[[str], Any]) -> Callable[[str], Any]:
    return lambda cell: kind(cell) if cell else None


_READERS: Mapping[str, Callable[[str], Any]] = MappingProxyType(
    {
        "str": printable,
        "int": _whole_number,
        "float": _number,
        "int | None": _optional(_whole_number),
        "float | None": _optional(_number),
        "tuple[int, ...]": lambda cell: tuple(
            _whole_number(each) for each in (cell.split(SEPARATOR) if cell else ())
        ),
        "tuple[str, ...]": lambda cell: tuple(printable(cell).split(SEPARATOR)) if cell else (),
    }
)
_EXPECTED = {
    "int": "a whole number from 0",
    "float": "a number",
    "tuple[int,": "whole numbers from 0",
}
_FIELDS = {field.name: str(field.type) for field in dataclasses.fields(ResultRow)}


def read_rows(path: Path) -> tuple[ResultRow, ...]:
    """Return the rows in a file, or no rows if the file does not exist.

    Raises ExperimentError that names file, line and column.
    """
    exists = path.exists() or path.is_symlink()
    text = read_text(path, LARGEST_BYTES, ExperimentError) if exists else ""
    if not text:
        return ()
    lines = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    try:
        _check_columns(path, lines.fieldnames or ())
        return tuple(_row(path, lines.line_num, cells) for cells in lines)
    except csv.Error as error:
        raise ExperimentError(
            f"{path}, line {lines.line_num + 1}: not valid CSV: {error}"
        ) from error


def _check_columns(path: Path, found: Sequence[str]) -> None:
    if tuple(found) != tuple(_FIELDS):
        wrong = {*found} ^ {*_FIELDS}
        raise ExperimentError(
            f"{path}: found other columns than expected"
            f"{': ' + listed(sorted(wrong)) if wrong else ', in another order'}. If another "
            "version of pytest-garl wrote the rows, keep them under another name"
        )


def _row(path: Path, line: int, cells: Mapping[str, str | None]) -> ResultRow:
    values = {}
    for name, kind in _FIELDS.items():
        cell = cells[name]
        if cell is None or len(cells) > len(_FIELDS):
            raise ExperimentError(
                f"{path}, line {line}: found too {'few' if cell is None else 'many'} cells, "
                f"expected {len(_FIELDS)}"
            )
        try:
            values[name] = _READERS[kind](cell)
        except ValueError as error:
            expected = _EXPECTED[kind.partition(" ")[0]]
            raise ExperimentError(
                f"{path}, line {line}: column {name!r}: found {shown(cell)}, expected {expected}"
            ) from error
    row = ResultRow(**values)
    counts = row.kind_counts
    if len(counts) != len(row.signatures) or sum(counts) != row.violations:
        raise ExperimentError(
            f"{path}, line {line}: column 'kind_counts': found {_cell(counts)}, expected "
            f"{len(row.signatures)} numbers, one for each signature, {row.violations} in all"
        )
    return row


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
