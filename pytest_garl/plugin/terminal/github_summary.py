"""The step summary of GitHub Actions: a table of the violations that were found."""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.execution.flight_id import OF_CASE
from pytest_garl.plugin.items.item_record import ItemRecord
from pytest_garl.plugin.items.suggested_commands import repeat_files_command
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.summary import renewal_lines
from pytest_garl.reports.html.index_markdown import index_parts, page_link
from pytest_garl.reports.run_markdown import Row, code, escaped, kinds_table, run_markdown
from pytest_garl.reports.run_record import RunRecord

if TYPE_CHECKING:
    from pytest_garl.reports.html.report import WrittenReport

VARIABLE = "GITHUB_STEP_SUMMARY"
"""GitHub names in this variable the file whose text it shows on the page of the step."""


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
    repeat = functools.partial(repeat_files_command, reporter.config)
    parts = run_markdown(record, repeat, pages, _failed_cases(reporter))
    parts += [*_failed_beside(reporter), *renewal_lines(reporter)]
    parts += index_parts(report.page, report.index.parent, run.options.report_url) if report else ()
    _append(reporter, parts)


def write_failures_alone(reporter: Any) -> None:
    """Append what failed in a session without a record of its searches, if GitHub names a file."""
    rows = _failed_cases(reporter)
    if parts := [*([kinds_table(rows)] if rows else []), *_failed_beside(reporter)]:
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
