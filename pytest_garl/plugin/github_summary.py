"""The step summary of GitHub Actions: a table of the violations that were found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.plugin.keys import SEVERITY, SIGNATURE, SLOT
from pytest_garl.reports.search_summary import WHY_NO_LANDING, SearchSummary, ViolationKind
from pytest_garl.reports.shares_text import PAPER_DEFINITION, kinds_lines, percent

VARIABLE = "GITHUB_STEP_SUMMARY"
"""GitHub names in this variable the file whose text it shows on the page of the step."""
COLUMNS = ("where", "what", "flights", "what happened", "at the least", "see it")
SHARES = (
    "where",
    "flown",
    "landed",
    "violations",
    PAPER_DEFINITION,
    *(f"gave up: {reason}" for reason in WHY_NO_LANDING),
    "not landed",
    "crashed",
    "inconclusive",
)

Row = tuple[str, str, str, str, str, str]


def write_step_summary(
    reporter: Any, searches: Sequence[SearchSummary], commands: Sequence[Sequence[str]]
) -> None:
    """Append the shares, the kinds of violation and the failed cases, if GitHub names a file.

    ``commands`` fly the first flight of each kind of each search again.
    """
    path = os.environ.get(VARIABLE)
    if not path:
        return
    rows: list[Row] = [
        (
            _where(search),
            kind.signature,
            _flights(search, kind),
            kind.headline,
            kind.severity_text,
            command,
        )
        for search, of_search in zip(searches, commands, strict=True)
        for kind, command in zip(search.kinds, of_search, strict=True)
    ]
    rows += _failed_cases(reporter)
    flown = sum(len(search.verdicts) for search in searches)
    tables = [_table(SHARES, [_shares(search) for search in searches])] if searches else []
    none = f"No violation{f' in {flown} flights' if flown else ''}."
    tables += [
        f"{_where(search)}: {_escaped(line)}" for search in searches for line in kinds_lines(search)
    ]
    tables.append(_table(COLUMNS, rows) if rows else none)
    text = "\n\n".join(tables)
    try:
        with Path(path).open("a", encoding="utf-8") as file:
            file.write(f"## pytest-garl\n\n{text}\n\n")
    except OSError as error:
        reporter.write_line(f"garl: {VARIABLE}: {path}: cannot be written ({error})")


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(columns)} |", f"|{' --- |' * len(columns)}"]
    for row in rows:
        cells = [
            _code(cell) if column == "see it" else _escaped(cell)
            for column, cell in zip(columns, row, strict=True)
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _where(search: SearchSummary) -> str:
    return f"{search.name} on {search.map}"


def _flights(search: SearchSummary, kind: ViolationKind) -> str:
    """Return the number of flights of a kind and, with a control arm, of the random ones."""
    if kind.in_control is None:
        return str(kind.count)
    return f"{kind.count} ({kind.in_control} of {search.random_flights} random)"


def _shares(search: SearchSummary) -> tuple[str, ...]:
    """Return the shares of a search, a cell for each of ``SHARES``."""
    total, gave_up = len(search.flights), search.without_landing("gave_up")
    counts = [
        search.count("landed"),
        search.violating,
        search.violating_by_the_paper,
        *(gave_up[reason] for reason in WHY_NO_LANDING),
        search.count("not_landed"),
        sum(search.crashes.values()),
        search.count("inconclusive"),
    ]
    return _where(search), str(total), *(percent(count, total) for count in counts)


def _failed_cases(reporter: Any) -> list[Row]:
    """Return the saved cases whose tests failed."""
    rows = []
    for report in reporter.getreports("failed"):
        properties = dict(report.user_properties)
        slot = str(properties.get(SLOT, ""))
        if slot.startswith("case-"):
            headline, _, see_it = _message(report).partition("\n")
            command = see_it.partition(": ")[2]
            signature, took = str(properties[SIGNATURE]), str(properties.get(SEVERITY, ""))
            rows.append((slot, signature, "1", headline, took, command))
    return rows


def _message(report: pytest.TestReport) -> str:
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message) if crash is not None else str(report.longrepr)


def _escaped(text: str) -> str:
    """Return text without meaning in Markdown or HTML."""
    for mark in "\\`*_[]<>|#~":
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())


def _code(text: str) -> str:
    """Return text as code in a cell of a table, or nothing."""
    plain = " ".join(text.replace("`", "").replace("|", "\\|").split())
    return f"`{plain}`" if plain else ""
