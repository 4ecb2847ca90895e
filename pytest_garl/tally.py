"""What the items of a session say of landings, gathered where pytest ends it."""

from __future__ import annotations

import json
from collections import Counter

import pytest

from pytest_garl.switches import EXCUSED, FAILURE, NOTHING, SLOT, UNREPEATED

FLOWN = "garl.outcome"


class Tally:
    """Listens to all reports, those of xdist's workers among them."""

    def __init__(self) -> None:
        self.items: set[str] = set()
        self.nothing: Counter[str] = Counter()
        self.flown = False
        self.unrepeated: set[tuple[str, ...]] = set()
        self.problems: list[str] = []
        self._failures: dict[str, str] = {}
        self._excused: dict[str, set[str]] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what counts for the session's colour."""
        told = dict(report.user_properties)
        if SLOT not in told or report.when == "teardown":
            return
        if NOTHING in told and report.nodeid not in self.items:
            self.nothing[str(told[NOTHING])] += 1
        self.items.add(report.nodeid)
        self.flown = self.flown or FLOWN in told
        # A test that is run again tells anew.
        self._failures.pop(report.nodeid, None)
        if FAILURE in told and report.failed:
            self._failures[report.nodeid] = str(told[FAILURE])
        if EXCUSED in told and report.skipped:
            self._excused.setdefault(str(told[EXCUSED]), set()).add(report.nodeid)
        if UNREPEATED in told:
            self.unrepeated.add(tuple(json.loads(str(told[UNREPEATED]))))

    def unfounded(self) -> list[str]:
        """Return the items that are excused by a failure that no item shows."""
        shown = set(self._failures.values())
        return sorted(
            item for key, items in self._excused.items() if key not in shown for item in items
        )
