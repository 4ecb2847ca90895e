"""The step summary of GitHub Actions: a table of the violations that were found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.execution.flight_id import OF_CASE
from pytest_garl.plugin.item_record import ItemRecord
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.suggested_commands import repeat_files_command
from pytest_garl.plugin.summary import renewal_lines
from pytest_garl.reports.html.index_markdown import index_parts, page_link
from pytest_garl.reports.markdown import code, escaped, table
from pytest_garl.reports.run_record import WHY_NO_LANDING, KindRecord, RunRecord, SearchRecord
from pytest_garl.reports.run_text import PAPER_DEFINITION, percent

if TYPE_CHECKING:
    from pytest_garl.reports.html.report import WrittenReport

VARIABLE = "GITHUB_STEP_SUMMARY"
"""GitHub names in this variable the file whose text it shows on the page of the step."""
COLUMNS = (
    "where",
    "what",
    "flights",
    "what happened",
    "conditions",
    "see it",
    "page",
)
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

Row = tuple[str, ...]


def write_step_summary(
    reporter: Any, run: Run, record: RunRecord, report: WrittenReport | None
) -> None:
    """Append the shares, the kinds of violation and the failed cases, if GitHub names a file.

    ``report`` is the folder of pages of the run, if one was written.
    """
    if not os.environ.get(VARIABLE):
        return
    pages = {}
    if report is not None:
        for row in report.page.kinds:
            link = page_link(row, report.index.parent, run.options.report_url)
            pages[row.page.where, row.kind.signature] = link
    rows: list[Row] = [
        (
            escaped(search.name),
            escaped(kind.signature),
            escaped(_flights(kind)),
            escaped("; ".join(filter(None, (kind.title, kind.headline)))),
            escaped(kind.least),
            code(repeat_files_command(reporter.config, search.key.files, kind.first)),
            pages.get((search.name, kind.signature), ""),
        )
        for search in record.searches
        for kind in search.kinds
    ]
    rows += _failed_cases(reporter)
    shares = [_shares(search) for search in record.searches]
    parts = [table(SHARES, shares)] if shares else []
    parts += [escaped(f"{each.name}: {line}") for each in record.searches for line in each.remarks]
    flown = f" in {record.flown} flights" if record.flown else ""
    parts.append(_kinds_table(rows) if rows else f"No violation{flown}.")
    parts += [*_failed_beside(reporter), *renewal_lines(reporter)]
    parts += index_parts(report.page, report.index.parent, run.options.report_url) if report else ()
    _append(reporter, parts)


def write_failures_alone(reporter: Any) -> None:
    """Append what failed in a session without a record of its searches, if GitHub names a file."""
    rows = _failed_cases(reporter)
    if parts := [*([_kinds_table(rows)] if rows else []), *_failed_beside(reporter)]:
        _append(reporter, parts)


def _append(reporter: Any, parts: Sequence[str]) -> None:
    path = os.environ.get(VARIABLE)
    if not path:
        return
    try:
        with Path(path).open("a", encoding="utf-8") as file:
            file.write("\n\n".join(("## pytest-garl", *parts, "")))
    except OSError as error:
        reporter.write_line(f"garl: {VARIABLE}: {path}: cannot be written ({error})")


def _kinds_table(rows: Sequence[Row]) -> str:
    """Return the table of kinds; without links to pages it has no column for them."""
    columns = len(COLUMNS) - (not any(row[-1] for row in rows))
    return table(COLUMNS[:columns], [row[:columns] for row in rows])


def _flights(kind: KindRecord) -> str:
    """Return the number of flights of a kind and, with a control arm, of the random ones."""
    if kind.in_control is None:
        return str(kind.count)
    return f"{kind.count} ({kind.in_control} of {kind.random_flights} random)"


def _shares(search: SearchRecord) -> tuple[str, ...]:
    """Return the shares of a search, a cell for each of ``SHARES``."""
    counts = [
        search.landed,
        search.violating,
        search.violating_by_the_paper,
        *(search.gave_up[reason] for reason in WHY_NO_LANDING),
        search.outcomes["not_landed"],
        sum(search.crashes.values()),
        len(search.inconclusive),
    ]
    shares = (percent(count, search.flown) for count in counts)
    return escaped(search.name), str(search.flown), *shares


def _failed_beside(reporter: Any) -> list[str]:
    """Return a line for each violated probe, and each file that nothing can fly any more."""
    lines = []
    for report in reporter.getreports("failed"):
        record = ItemRecord.of(report)
        if report.when == "call":
            lines += [f"Lost: {escaped(record.lost)}"] if record.lost else []
            lines += [f"Probe: {escaped(each)}" for each in record.violated_probes]
    return lines


def _failed_cases(reporter: Any) -> list[Row]:
    """Return the saved cases whose tests failed."""
    rows = []
    for report in reporter.getreports("failed"):
        record = ItemRecord.of(report)
        slot = record.slot or ""
        if slot.startswith(OF_CASE):
            headline, _, see_it = _message(report).partition("\n")
            command = see_it.partition(": ")[2]
            texts = (slot, record.signature or "", "1", headline, record.severity)
            rows.append((*map(escaped, texts), code(command), ""))
    return rows


def _message(report: pytest.TestReport) -> str:
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message) if crash is not None else str(report.longrepr)
