"""Write the decided outcome of an item into its report: text, and the fields of its record."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import folder_of
from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.items.item_record import ItemRecord
from pytest_garl.plugin.items.keys import LANDING, RUN, target_of
from pytest_garl.plugin.items.outcomes import (
    Decision,
    FailedItem,
    Reason,
    UnjudgedFlight,
    resolve,
    why_unjudged,
)
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.session import report_text
from pytest_garl.plugin.session.item_facts import (
    ItemFailure,
    failed_item,
    failure_facts,
    failure_of_item,
    passed_case,
    slot_claim,
)
from pytest_garl.plugin.session.report_text import FailureText
from pytest_garl.plugin.session.run import Run
from pytest_garl.reports.html.naming import page_address, page_name


def end_unjudged(item: pytest.Item) -> None:
    """Fail or skip a test whose flight no assertion can judge; ``outcomes`` decides which."""
    landing, target = item.stash.get(LANDING, None), target_of(item)
    if landing is None or target is None:
        return
    result = landing.unnoted_result
    if not (unjudged := why_unjudged(result)):
        return
    run = item.config.stash[RUN]
    facts = UnjudgedFlight(
        inconclusive=result.inconclusive,
        alone=target.entry is not None or bool(run.options.repeat),
        expects_failure=item.get_closest_marker("xfail") is not None,
    )
    decision, _ = resolve(facts, slot_claim(run, target, item.nodeid))
    if decision.outcome == "skipped":
        pytest.skip(unjudged)
    pytest.fail(report_text.unjudged_text(result, unjudged), pytrace=False)


def report_item(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    error: BaseException | None,
) -> None:
    """Decide the outcome of an item that asked for its landing, and write it into the report."""
    landing = item.stash.get(LANDING, None)
    if not isinstance(item, pytest.Function) or landing is None:
        return
    result = landing.unnoted_result
    writer = _Writer(report=report, item=item, run=run, target=target, result=result)
    if report.failed and error is not None:
        writer.write_failure(error)
    elif report.passed:
        writer.write_pass()
    elif landing.left_to_another_test:
        # Another test of the slot reports the violation; the session checks that.
        ItemRecord(left_to_another=True).add_to(report)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Writer:
    """Writes what is decided about one item into its report."""

    report: pytest.TestReport
    item: pytest.Function
    run: Run
    target: Target
    result: FlightResult

    @property
    def case(self) -> Case | None:
        """The saved case that the item flies."""
        return self.target.entry.case if self.target.entry is not None else None

    @property
    def _case_file(self) -> str:
        entry = self.target.entry
        return shown_path(entry.path, self.item.config) if entry is not None else ""

    def write_failure(self, error: BaseException) -> None:
        """Write the outcome of a test that failed."""
        failure = failure_of_item(self.item, self.target, self.result, error)
        if failure is not None:
            self._note_failure(failure)
        facts = failed_item(self.run, self.target, self.result, failure)
        gather = failure_facts(self.run, self.target, failure, self.item.nodeid)
        decision, facts = resolve(facts, gather)
        if decision.reason is Reason.TEST_ERROR:
            text = report_text.error_text(self.item, self.target, error)
            self.report.sections.append(("garl: what happened", text))
        elif decision.reason is Reason.INCONCLUSIVE:
            undecided = self.result.undecided
            self._fail(report_text.inconclusive_text(self.item, self.target, undecided))
        elif failure is not None and self.case is not None:
            self._write_failing_case(self.case, failure, decision, facts)
        elif failure is not None:
            self._write_violation(failure, decision, facts)

    def write_pass(self) -> None:
        """Write the outcome of a test that passed; only a saved case has more to say."""
        # The fixture ``landing`` has found it out.
        unproven = ItemRecord.of(self.item).unproven
        facts = passed_case(self.run, self.target, self.result, unproven)
        if facts is None:
            return None
        decision, _ = resolve(facts, slot_claim(self.run, self.target, self.item.nodeid))
        file = self._case_file
        if decision.outcome == "xfailed":
            return self._expect(report_text.passing_edge(facts.case, file))
        if decision.reason is Reason.STALE:
            ItemRecord(stale=f"{file} passes, but {unproven}").add_to(self.report)
        elif decision.reason is Reason.MAYBE_FIXED:
            ItemRecord(maybe_fixed=file).add_to(self.report)
        elif decision.reason is Reason.OTHER_ENGINE:
            text = f"{file}: {facts.case.of_another_engine}"
            ItemRecord(passes_elsewhere=text).add_to(self.report)
        if decision.outcome == "failed":
            self.report.outcome = "failed"
            self.report.longrepr = report_text.passing_failure(decision, file, unproven)
        return None

    def _write_failing_case(
        self, case: Case, failure: ItemFailure, decision: Decision, facts: FailedItem
    ) -> None:
        file = self._case_file
        took, severity = "", self.result.severity
        if severity is not None and not failure.user_property:
            took = severity.text if case.is_shrunk else severity.unusual
        ItemRecord(failing_case=file, severity=took).add_to(self.report)
        if decision.outcome == "xfailed":
            return self._expect(report_text.expected_failure(decision, facts, file))
        flown = (failure.signature, self.result.verdict.story)
        return self._fail(report_text.case_text(decision, case, file, self.item.config, flown))

    def _write_violation(self, failure: ItemFailure, decision: Decision, facts: FailedItem) -> None:
        target, reason = self.target, decision.reason
        key, failed = failure.key(target.search), decision.outcome == "failed"
        ItemRecord(
            reported_failure=key if failed else "",
            duplicate_of=key if reason is Reason.DUPLICATE else "",
            excused_by=self._known_file(facts) if reason is Reason.EXPECTED else "",
            not_repeated=reason is Reason.NOT_REPEATED,
            savable=failed and failure.savable,
        ).add_to(self.report)
        if self.run.options.report is not None:
            self._note_page(self.run.options.report, failure.signature)
        if not failed:
            return self._expect(report_text.expected_failure(decision, facts, ""))
        if failure.savable:
            self._note_finding_test(failure)
        return self._fail(
            report_text.violation_text(self.item, self.run, target, failure, self.result, facts)
        )

    def _known_file(self, facts: FailedItem) -> str:
        """Return the file of the known case that excuses a violation."""
        folder = folder_of(self.run.corpus.folder, self.target.system_name)
        return shown_path(folder / str(facts.expected_by), self.item.config)

    def _note_page(self, folder: Path, signature: str) -> None:
        """Note where the page of a violation will be, for JUnit XML.

        Jenkins and GitLab take a file that the captured output names so for an attachment; pytest
        writes that output if the ini key ``junit_logging`` asks for it.
        """
        config, target = self.item.config, self.target
        name = self.run.search_names[target.search]
        file = folder / page_address(page_name(target.system_name, target.map, name, signature))
        url = self.run.options.report_url
        shown = os.path.relpath(file, config.rootpath)
        address = f"{url}/{file.relative_to(folder).as_posix()}" if url else shown
        # JUnit XML has the properties and the output of the last report, that of the teardown.
        ItemRecord(page=address).add_to(self.item)
        self.item.add_report_section("call", "stdout", f"[[ATTACHMENT|{file.absolute()}]]\n")

    def _note_failure(self, failure: ItemFailure) -> None:
        """Note what an item shows, whatever its outcome is; the summary counts users' properties.

        It does not count them of saved cases and of flights that were not decided.
        """
        counts = failure.user_property and self.case is None and not self.result.inconclusive
        failed = failure.failed_assertion if counts else None
        ItemRecord(
            system=self.target.system_name,
            map=self.target.map,
            search=self.target.search,
            failure_signature=failure.signature,
            user_message=failed.message if failed is not None else None,
            shows_violation=not failure.user_property,
        ).add_to(self.report)

    def _note_finding_test(self, failure: ItemFailure) -> None:
        """Remember which test found a violation: it judges the case that is saved."""
        run, search = self.run, self.target.search
        if failure.user_property:
            run.user_assertions[search, failure.signature] = failure.assertion
        run.note_finding_test(search, failure.signature, self.item.nodeid)

    def _expect(self, reason: str) -> None:
        """Make the failure an expected one."""
        self.report.outcome = "skipped"
        self.report.wasxfail = reason

    def _fail(self, text: FailureText) -> None:
        """Add text to a failure, and say the headline where one or two lines are shown."""
        self.report.sections.append(("garl: what happened", "\n".join(text.lines)))
        crash = getattr(self.report.longrepr, "reprcrash", None)
        if crash is not None:
            # The short summary shows the first line, JUnit's message as many as fit.
            crash.message = f"{text.headline}\n{text.command}"
