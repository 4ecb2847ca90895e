"""What the items of a session say of landings, gathered where pytest ends it."""

from __future__ import annotations

import json
from collections import Counter

import pytest

from pytest_garl.plugin.keys import EXCUSED, FAILURE, NOTHING, SLOT, UNREPEATED

FLOWN = "garl.outcome"
SIGNATURE = "garl.signature"


class Tally:
    """Listens to all reports, those of xdist's workers among them."""

    def __init__(self) -> None:
        self.items: set[str] = set()
        self.nothing: Counter[str] = Counter()
        self.flown = False
        self.unrepeated: set[tuple[str, ...]] = set()
        self.problems: list[str] = []
        self._violating: dict[tuple[str, str], str] = {}
        self._answered: set[tuple[str, str]] = set()
        self._failures: dict[str, str] = {}
        self._excused: dict[str, set[str]] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what counts for the session's colour."""
        if report.when == "setup":
            # A test that is run again tells anew; one with subtests tells more than once.
            self._failures.pop(report.nodeid, None)
        told = dict(report.user_properties)
        if SLOT not in told or report.when == "teardown":
            return
        if NOTHING in told and report.nodeid not in self.items:
            self.nothing[str(told[NOTHING])] += 1
        self.items.add(report.nodeid)
        self.flown = self.flown or FLOWN in told
        flight = (report.nodeid.partition("::")[0], str(told[SLOT]))
        if told.get(SIGNATURE):
            self._violating[flight] = str(told[SIGNATURE])
        if report.failed or hasattr(report, "wasxfail"):
            self._answered.add(flight)
        if FAILURE in told and report.failed:
            self._failures[report.nodeid] = str(told[FAILURE])
        if EXCUSED in told and report.skipped:
            self._excused.setdefault(str(told[EXCUSED]), set()).add(report.nodeid)
        if UNREPEATED in told:
            self.unrepeated.add(tuple(json.loads(str(told[UNREPEATED]))))

    @property
    def unasserted(self) -> Counter[str]:
        """Violations for which no selected test fails, by signature: how many flights."""
        return Counter(
            signature
            for flight, signature in self._violating.items()
            if flight not in self._answered
        )

    def unfounded(self) -> list[str]:
        """Return the items that are excused by a failure that no item shows."""
        shown = set(self._failures.values())
        return sorted(
            item for key, items in self._excused.items() if key not in shown for item in items
        )
