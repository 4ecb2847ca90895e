"""The step summary of GitHub Actions: a short table of what was found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.reports.violation_kinds import Found

VARIABLE = "GITHUB_STEP_SUMMARY"
"""Names the file to which a step appends what its page shows."""

HEAD = ("where", "what", "flights", "what happened", "see it")


def write_summary(reporter: Any, found: Sequence[Found], again: Sequence[Sequence[str]]) -> None:
    """Append the kinds of violation and the failed cases to the summary, where there is one.

    ``again`` are the commands that fly each kind of ``found`` again.
    """
    path = os.environ.get(VARIABLE)
    if not path:
        return
    rows = [
        (f"{each.name} on {each.map}", kind.signature, str(kind.count), kind.headline, command)
        for each, commands in zip(found, again, strict=True)
        for kind, command in zip(each.kinds, commands, strict=True)
    ]
    rows += _cases(reporter)
    title = "## pytest-garl\n\n"
    lines = [
        "| where | what | flights | what happened | see it |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [f"| {' | '.join([*map(_plain, row[:4]), _code(row[4])])} |" for row in rows]
    flown = sum(len(each.verdicts) for each in found)
    body = "\n".join(lines) if rows else f"No violation{f' in {flown} flights' if flown else ''}."
    try:
        with Path(path).open("a", encoding="utf-8") as file:
            file.write(f"{title}{body}\n\n")
    except OSError as error:
        reporter.write_line(f"garl: {VARIABLE}: {path}: cannot be written ({error})")


def _cases(reporter: Any) -> list[tuple[str, str, str, str, str]]:
    """Return the saved cases whose tests failed."""
    rows = []
    for report in reporter.getreports("failed"):
        told = dict(report.user_properties)
        slot = str(told.get("garl.slot", ""))
        if slot.startswith("case-"):
            what, _, again = _message(report).partition("\n")
            command = again.partition(": ")[2]
            rows.append((slot, str(told["garl.signature"]), "1", what, command))
    return rows


def _message(report: pytest.TestReport) -> str:
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message) if crash is not None else str(report.longrepr)


def _plain(text: str) -> str:
    """Return text that means nothing in Markdown or HTML."""
    for mark in "\\`*_[]<>|#~":
        text = text.replace(mark, f"\\{mark}")
    return " ".join(text.split())


def _code(text: str) -> str:
    return (
        f"`{' '.join(text.replace('`', '').replace('|', chr(92) + '|').split())}`" if text else ""
    )
