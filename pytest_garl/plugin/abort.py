"""End a session that cannot go on: without its ledger or NPC policy no other item can be flown.

A worker of pytest-xdist cannot end the session.  It tells the controller by a user property.
"""

from __future__ import annotations

from typing import NoReturn

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.keys import FATAL, is_xdist_worker


def abort_session(item: pytest.Item, error: GarlError) -> NoReturn:
    """End the session while an item runs."""
    if not is_xdist_worker(item.config):
        pytest.exit(f"garl: {error}", returncode=pytest.ExitCode.INTERNAL_ERROR)
    item.user_properties.append((FATAL, str(error)))
    pytest.fail(f"garl: {error}", pytrace=False)


def fail_report(report: pytest.TestReport, error: GarlError) -> None:
    """Fail a report whose item has run, and end the session when the report is logged."""
    report.outcome, report.longrepr = "failed", f"garl: {error}"
    report.user_properties.append((FATAL, str(error)))


def abort_if_reported(report: pytest.TestReport) -> None:
    """End the session if a report says that it cannot go on."""
    for key, value in report.user_properties:
        if key == FATAL:
            raise pytest.exit.Exception(f"garl: {value}", pytest.ExitCode.INTERNAL_ERROR)
