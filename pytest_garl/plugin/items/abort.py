"""End a session that cannot go on: without its ledger or NPC policy no other item can be flown.

A worker of pytest-xdist cannot end the session.  It tells the controller in an item's record.
A session that somebody interrupts ends with its summary.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import TYPE_CHECKING, NoReturn, cast

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.xdist import is_xdist_worker

if TYPE_CHECKING:
    from pytest_garl.plugin.items.item_record import ItemRecord


def abort_session(item: pytest.Item, error: GarlError) -> NoReturn:
    """End the session while an item runs."""
    if not is_xdist_worker(item.config):
        pytest.exit(f"garl: {error}", returncode=pytest.ExitCode.INTERNAL_ERROR)
    _note(item, error)
    pytest.fail(f"garl: {error}", pytrace=False)


def fail_report(report: pytest.TestReport, error: GarlError) -> None:
    """Fail a report whose item has run, and end the session when the report is logged."""
    report.outcome, report.longrepr = "failed", f"garl: {error}"
    _note(report, error)


def abort_if_fatal(record: ItemRecord) -> None:
    """End the session, by raising pytest's ``Exit``, if an item says that it cannot go on."""
    if record.fatal:
        raise pytest.exit.Exception(f"garl: {record.fatal}", pytest.ExitCode.INTERNAL_ERROR)


def _note(target: pytest.Item | pytest.TestReport, error: GarlError) -> None:
    from pytest_garl.plugin.items.item_record import ItemRecord

    ItemRecord(fatal=str(error)).add_to(target)


def drop_entries_without_line(error: BaseException | None) -> None:
    """Take out of an error's tracebacks what pytest cannot show: entries without a line number.

    Python 3.11 compiles some instructions, such as the jump back to the start of a loop, without a
    line.  If Ctrl-C interrupts one of them, ``tb_lineno`` is None, and pytest 9.2 ends in a
    TypeError instead of its summary.
    """
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        kept: TracebackType | None = None
        for entry in reversed([each for each in _entries(error) if _has_line(each)]):
            entry.tb_next = kept
            kept = entry
        error.__traceback__ = kept
        error = error.__context__ if error.__cause__ is None else error.__cause__


def _entries(error: BaseException) -> Iterator[TracebackType]:
    entry = error.__traceback__
    while entry is not None:
        yield entry
        entry = entry.tb_next


def _has_line(entry: TracebackType) -> bool:
    return cast("int | None", entry.tb_lineno) is not None
