"""Count what the reports of landing items say; the controller of a session keeps it to the end."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Generator, Iterator
from typing import TYPE_CHECKING

import pytest

from pytest_garl.plugin.items.keys import RECORD_PREFIX

if TYPE_CHECKING:
    from pytest_garl.execution.facts import FailedFlightAssertion
    from pytest_garl.plugin.items.item_record import ItemRecord
    from pytest_garl.plugin.session.run import Run
    from pytest_garl.reports.run_record import RunRecord


def noted_in(report: pytest.TestReport) -> ItemRecord | None:
    """Return what an item says in a report, None if that is nothing, as in most suites."""
    if not any(str(name).startswith(RECORD_PREFIX) for name, _ in report.user_properties):
        return None
    from pytest_garl.plugin.items.item_record import ItemRecord

    return ItemRecord.of(report)


class Tally:
    """Gathers all reports, those of xdist's workers among them."""

    def __init__(self) -> None:
        self.items: set[str] = set()
        self.no_flight: Counter[str] = Counter()
        self.flown = False
        self.problems: list[str] = []
        self.tests_ran = False
        """Whether pytest ran all selected tests, and did not only collect them."""
        self.stopped = False
        """Whether the session is red and ended before all tests ran (``-x``, Ctrl-C): those that
        would have failed for what was found may be among the others."""
        self.interrupted = False
        """Whether somebody ended the session with Ctrl-C or SIGTERM."""
        self._signatures: dict[str, str] = {}
        self._failing_flights: set[str] = set()
        self._said: dict[str, list[tuple[pytest.TestReport, ItemRecord]]] = {}
        """What each item says of its call; a test with subtests reports more than once."""
        self.record: RunRecord | None = None
        """What was found, once all has been flown."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember what decides the exit status and what the summary shows."""
        if report.when == "setup":
            # A test that runs again reports anew.
            self._said.pop(report.nodeid, None)
        record = noted_in(report)
        if record is None:
            return
        if report.when == "call":
            self._said.setdefault(report.nodeid, []).append((report, record))
        if record.flight:
            if record.signature and not record.expected:
                self._signatures[record.flight] = record.signature
            if report.failed or _shows_violation(report, record):
                self._failing_flights.add(record.flight)
        if record.slot is not None and report.when != "teardown":
            if record.no_flight and report.nodeid not in self.items:
                self.no_flight[record.no_flight] += 1
            self.items.add(report.nodeid)
            self.flown = self.flown or record.outcome is not None

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
    def records(self) -> list[ItemRecord]:
        """What the items say of their calls."""
        return [record for _, record in self._calls()]

    @property
    def hidden(self) -> dict[str, str]:
        """What pytest-garl's own items found that pytest does not report as a failure."""
        return {
            report.nodeid: record.found
            for report, record in self._calls()
            if record.found and not report.failed
        }

    @property
    def user_failures(self) -> list[FailedFlightAssertion]:
        """The failed assertions about users' own properties, expected ones among them."""
        from pytest_garl.execution.facts import FailedFlightAssertion

        return [
            FailedFlightAssertion(
                search=record.search,
                slot=record.slot or "",
                signature=record.failure_signature,
                message=record.user_message,
            )
            for record in self.records
            if record.user_message is not None
        ]

    def run_record(self, run: Run) -> RunRecord:
        """Return the record of the run, read once when all has been flown."""
        if self.record is None:
            from pytest_garl.reports.run_reading import run_record_of

            if run.options.searches_or_repeats:
                run.ledger.facts.note_user_failures(self.user_failures)
                run.ledger.facts.note_ended()
            self.record = run_record_of(
                run.ledger,
                run.corpus,
                investigated=[each.result.case for each in run.investigated if each.result.case],
                confirming=run.investigations.flown if run.investigations else 0,
            )
        return self.record

    def search_name(self, item: ItemRecord) -> str:
        """Return what texts call the search of an item's flight."""
        from pytest_garl.execution.facts import SearchKey

        place = SearchKey(system=item.system, map=item.map).place
        return self.record.names.get(item.search, place) if self.record else place

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
        calls = [*self._calls()]
        reported = {"", *(record.reported_failure for report, record in calls if report.failed)}
        shown = {record.flight for report, record in calls if _shows_violation(report, record)}
        return sorted(
            {
                report.nodeid
                for report, record in calls
                if report.skipped
                if record.duplicate_of not in reported
                or (record.left_to_another and record.flight not in shown)
            }
        )

    def _calls(self) -> Iterator[tuple[pytest.TestReport, ItemRecord]]:
        return itertools.chain.from_iterable(self._said.values())


def _shows_violation(report: pytest.TestReport, record: ItemRecord) -> bool:
    """Whether an item fails for a violation, or pytest-garl excuses it.

    A mark xfail of the test's hides the violation.
    """
    return record.shows_violation and (report.failed or hasattr(report, "wasxfail"))
