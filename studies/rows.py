"""Rows of a table of results: a CSV file that grows while a benchmark runs."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pytest_garl.verdicts.statistics import share_interval


def read(path: Path) -> list[dict[str, str]]:
    """Return what was measured so far."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def append(path: Path, fields: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Add rows at once, so that nothing is lost where the next is interrupted, and print them."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, fields)
        if new:
            writer.writeheader()
        for row in rows:
            writer.writerow(row)
            print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)


def share(count: int, total: int) -> str:
    """Return a percentage with its 95 % interval."""
    low, high = share_interval(count, total)
    return f"{100 * count / total:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
