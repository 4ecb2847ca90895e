"""What the items of a session say of landings, gathered where pytest ends it."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING

import pytest

from pytest_garl.plugin.keys import (
    DUPLICATE_OF,
    NO_FLIGHT,
    NOT_REPEATED,
    OUTCOME,
    REPORTED_FAILURE,
    SIGNATURE,
    SLOT,
    USER_FAILURE,
)

if TYPE_CHECKING:
    from pytest_garl.execution.ledger import Ledger
    from pytest_garl.reports.search_summary import SearchSummary, SlotUserFailure


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
        self._user_failures: dict[str, list[str]] = {}
        self._searches: list[SearchSummary] | None = None

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what counts for the session's colour."""
        if report.when == "setup":
            # A test that is run again tells anew; one with subtests tells more than once.
            self._failures.pop(report.nodeid, None)
            self._user_failures.pop(report.nodeid, None)
        told = dict(report.user_properties)
        if SLOT not in told or report.when == "teardown":
            return
        if NO_FLIGHT in told and report.nodeid not in self.items:
            self.nothing[str(told[NO_FLIGHT])] += 1
        self.items.add(report.nodeid)
        self.flown = self.flown or OUTCOME in told
        flight = (report.nodeid.partition("::")[0], str(told[SLOT]))
        if told.get(SIGNATURE):
            self._violating[flight] = str(told[SIGNATURE])
        if report.failed or hasattr(report, "wasxfail"):
            self._answered.add(flight)
        if REPORTED_FAILURE in told and report.failed:
            self._failures[report.nodeid] = str(told[REPORTED_FAILURE])
        if DUPLICATE_OF in told and report.skipped:
            self._excused.setdefault(str(told[DUPLICATE_OF]), set()).add(report.nodeid)
        if USER_FAILURE in told:
            self._user_failures.setdefault(report.nodeid, []).append(str(told[USER_FAILURE]))
        if NOT_REPEATED in told:
            self.unrepeated.add(tuple(json.loads(str(told[NOT_REPEATED]))))

    @property
    def user_failures(self) -> list[SlotUserFailure]:
        """The failed assertions about users' own properties, expected ones among them."""
        from pytest_garl.reports.search_summary import SlotUserFailure

        names = ("system", "map", "slot", "signature", "message")
        return [
            SlotUserFailure(**dict(zip(names, json.loads(text), strict=True)))
            for texts in self._user_failures.values()
            for text in texts
        ]

    def search_summaries(self, ledger: Ledger) -> list[SearchSummary]:
        """Return the summary of each search, read from the ledger once when all has been flown."""
        from pytest_garl.reports.search_summary import search_summaries

        if self._searches is None:
            self._searches = search_summaries(ledger, self.user_failures)
        return self._searches

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
