"""Tables of saved cases for the terminal: all cases, and the scenario of one."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import CorpusEntry
from pytest_garl.cases.description import describe_scenario
from pytest_garl.messages import printable

if TYPE_CHECKING:
    from pytest_garl.cases.renewal import Renewal

_ENDLESS = 100_000
"""Width of a table outside a terminal, so that no name is cut."""
_STYLES = {"open": "yellow", "fixed": "green"}


def case_table(found: Iterable[CorpusEntry]) -> Table:
    """Return a table of cases with status, signature, robustness and number of objects."""
    table = Table(box=None, header_style="bold")
    for name in ("case", "status", "signature", "robust", "objects"):
        table.add_column(name, overflow="fold")
    for entry in found:
        where = Text(printable(f"{entry.path.parent.name}/{entry.name}", keep=""))
        if entry.case is None:
            table.add_row(where, Text("broken", style="red"))
            continue
        case, evidence = entry.case, entry.case.evidence
        robust = (
            f"{evidence.neighbours_failed}/{evidence.neighbours}" if evidence.neighbours else ""
        )
        if case.severity.window_s is not None:
            robust = f"{case.severity.window_s:g} s"
        objects = str(len(case.moves))
        # In a plain string rich would draw ":dog:" as an emoji, and read "[red]" as a colour.
        signature = Text(printable(case.violation.signature, keep=""))
        status = Text(case.status, style=_STYLES.get(case.status, "dim"))
        if not case.gates:
            status.append(f" ({case.reason})")
        table.add_row(where, status, signature, robust, objects)
    return table


def renamed_table(renewals: Sequence[Renewal]) -> Table:
    """Return a table of the cases with new signatures or names: what they were, and what they are.

    Each renewal has been written.
    """
    table = Table(box=None, header_style="bold")
    for name in ("case", "is", "signature", "is"):
        table.add_column(name, overflow="fold")
    for each in renewals:
        assert each.case is not None
        assert each.written is not None
        names = (f"{each.path.parent.name}/{each.path.stem}", each.written.stem)
        signatures = (each.before.violation.signature, each.case.violation.signature)
        table.add_row(*(Text(printable(text, keep="")) for text in (*names, *signatures)))
    return table


def scenario_table(case: Case, map_folders: tuple[Path, ...]) -> Table:
    """Return a table of a case's scenario in words and physical units."""
    table = Table(box=None, header_style="bold")
    for name in ("what", "meaning"):
        table.add_column(name)
    for row in describe_scenario(case.scenario, map_folders, case.policy):
        table.add_row(*(Text(cell) for cell in row))
    return table


def environment_changes(case: Case) -> list[tuple[str, float]]:
    """Return the sum of the policies' changes for each gene of the environment."""
    totals: dict[str, float] = {}
    for _, own in case.changes:
        for _, key, by in own:
            totals[key] = totals.get(key, 0.0) + by
    return sorted(totals.items())


def print_table(table: Table) -> None:
    """Print a table: folded on a terminal, with whole lines in a pipe."""
    Console(width=None if sys.stdout.isatty() else _ENDLESS).print(table)
