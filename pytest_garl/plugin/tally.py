"""Count what the reports of landing items say; the controller of a session keeps it to the end."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Generator, Mapping
from typing import TYPE_CHECKING

import pytest

from pytest_garl.plugin.keys import (
    DUPLICATE_OF,
    EXCUSED,
    EXPECTED,
    FLIGHT,
    FOUND,
    GATE_REPORT,
    LEFT_TO_ANOTHER,
    NO_FLIGHT,
    NOT_REPEATED,
    OUTCOME,
    REPORTED_FAILURE,
    SHOWN_VIOLATION,
    SIGNATURE,
    SLOT,
    USER_FAILURE,
)

if TYPE_CHECKING:
    from pytest_garl.execution.facts import UserFailure
    from pytest_garl.plugin.run import Run
    from pytest_garl.reports.run_record import RunRecord


class Tally:
    """Gathers all reports, those of xdist's workers among them."""

    def __init__(self) -> None:
        self.items: set[str] = set()
        self.no_flight: Counter[str] = Counter()
        self.flown = False
        self.gated = False
        """Whether a baseline's gate has flown."""
        self.not_repeated: set[tuple[str, ...]] = set()
        self.excused: set[tuple[str, ...]] = set()
        """System, map, slot, ending and file of each violation that a known case excuses."""
        self.problems: list[str] = []
        self.tests_ran = False
        """Whether pytest ran all selected tests, and did not only collect them."""
        self.stopped = False
        """Whether the session is red and ended before all tests ran (``-x``, Ctrl-C): those that
        would have failed for what was found may be among the others."""
        self.interrupted = False
        """Whether somebody ended the session with Ctrl-C or SIGTERM."""
        self.hidden: dict[str, str] = {}
        """What pytest-garl's own items found that pytest does not report as a failure."""
        self._signatures: dict[str, str] = {}
        self._failing_flights: set[str] = set()
        self._failures: dict[str, str] = {}
        self._excused: dict[str, set[str]] = {}
        self._shown: dict[str, str] = {}
        self._left_to_others: dict[str, str] = {}
        self._user_failures: dict[str, list[str]] = {}
        self.record: RunRecord | None = None
        """What was found, once all has been flown."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what decides the exit status and what the summary shows."""
        if report.when == "setup":
            # A test that runs again reports anew; one with subtests reports more than once.
            self._failures.pop(report.nodeid, None)
            for noted in (self._user_failures, self._shown, self._left_to_others, self.hidden):
                noted.pop(report.nodeid, None)
        properties = dict(report.user_properties)
        self.gated = self.gated or GATE_REPORT in properties
        if FOUND in properties and report.when == "call" and not report.failed:
            self.hidden[report.nodeid] = str(properties[FOUND])
        if FLIGHT in properties:
            self._note_flight(str(properties[FLIGHT]), report, properties)
        if SLOT not in properties or report.when == "teardown":
            return
        if NO_FLIGHT in properties and report.nodeid not in self.items:
            self.no_flight[str(properties[NO_FLIGHT])] += 1
        self.items.add(report.nodeid)
        self.flown = self.flown or OUTCOME in properties
        if REPORTED_FAILURE in properties and report.failed:
            self._failures[report.nodeid] = str(properties[REPORTED_FAILURE])
        if SHOWN_VIOLATION in properties and (report.failed or hasattr(report, "wasxfail")):
            self._shown[report.nodeid] = str(properties[SHOWN_VIOLATION])
        if LEFT_TO_ANOTHER in properties and report.skipped:
            self._left_to_others[report.nodeid] = str(properties[LEFT_TO_ANOTHER])
        if DUPLICATE_OF in properties and report.skipped:
            self._excused.setdefault(str(properties[DUPLICATE_OF]), set()).add(report.nodeid)
        if USER_FAILURE in properties:
            self._user_failures.setdefault(report.nodeid, []).append(str(properties[USER_FAILURE]))
        if EXCUSED in properties:
            self.excused.add(tuple(json.loads(str(properties[EXCUSED]))))
        if NOT_REPEATED in properties:
            self.not_repeated.add(tuple(json.loads(str(properties[NOT_REPEATED]))))

    def _note_flight(
        self, flight: str, report: pytest.TestReport, properties: Mapping[str, object]
    ) -> None:
        """Note whether a flight violates something, and whether an item fails for it."""
        if properties.get(SIGNATURE) and EXPECTED not in properties:
            self._signatures[flight] = str(properties[SIGNATURE])
        # An item that pytest-garl excuses shows its violation; a mark xfail of the test's hides it.
        excused = SHOWN_VIOLATION in properties and hasattr(report, "wasxfail")
        if report.failed or excused:
            self._failing_flights.add(flight)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Generator[None, object, object]:
        """Note that the selected tests ran to the end."""
        result = yield
        self.tests_ran = not session.config.option.collectonly
        return result

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        """Note that somebody wants the session to end."""
        from pytest_garl.plugin.termination import ignore_further_sigterm, is_interrupted_by_user

        self.interrupted = is_interrupted_by_user(excinfo.type)
        if self.interrupted:
            ignore_further_sigterm()

    @property
    def user_failures(self) -> list[UserFailure]:
        """The failed assertions about users' own properties, expected ones among them."""
        from pytest_garl.execution.facts import UserFailure

        names = ("search", "slot", "signature", "message")
        return [
            UserFailure(**dict(zip(names, json.loads(text), strict=True)))
            for texts in self._user_failures.values()
            for text in texts
        ]

    def run_record(self, run: Run) -> RunRecord:
        """Return the record of the run, read once when all has been flown."""
        if self.record is None:
            from pytest_garl.reports.run_reading import SessionFindings, record_of

            if run.options.searches_or_repeats:
                run.ledger.facts.note_user_failures(self.user_failures)
                run.ledger.facts.note_ended()
            found = SessionFindings(
                cases=tuple(each.result.case for each in run.investigated if each.result.case),
                confirming=run.investigations.flown if run.investigations else 0,
            )
            self.record = record_of(run.ledger, run.corpus, found)
        return self.record

    @property
    def unasserted(self) -> Counter[str]:
        """How many flights violate without failing any selected test, by signature."""
        return Counter(
            signature
            for flight, signature in self._signatures.items()
            if flight not in self._failing_flights
        )

    def wrongly_excused(self) -> list[str]:
        """Return the items that are excused by a failure that no item reports."""
        reported, shown = set(self._failures.values()), set(self._shown.values())
        excused = {
            item for key, items in self._excused.items() if key not in reported for item in items
        }
        left = {item for item, slot in self._left_to_others.items() if slot not in shown}
        return sorted(excused | left)
