"""Write the decided outcome of an item into its report: text, and properties for the summary."""

from __future__ import annotations

import dataclasses
import json

import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin import report_text
from pytest_garl.plugin.item_failure import (
    ItemFailure,
    failure_of_item,
    first_with_same_signature,
    refly,
)
from pytest_garl.plugin.keys import (
    CASE,
    DUPLICATE_OF,
    FINDING_TEST,
    LANDING,
    MAYBE_FIXED,
    NOT_REPEATED,
    REPORTED_FAILURE,
    RUN,
    STALE,
    UNPROVEN,
    USER_FAILURE,
    WORKER_ASSERTION,
    is_xdist_worker,
    target_of,
)
from pytest_garl.plugin.outcomes import (
    CaseState,
    Decision,
    FailedItem,
    Need,
    PassedCase,
    Reason,
    UnjudgedFlight,
    resolve,
)
from pytest_garl.plugin.report_text import FailureText
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.suggested_commands import shown_path
from pytest_garl.plugin.target import Target
from pytest_garl.regressions.case import Case


def end_unjudged(item: pytest.Item) -> None:
    """Fail or skip a test whose flight no assertion can judge; ``outcomes`` decides which."""
    landing = item.stash.get(LANDING, None)
    target = target_of(item)
    if landing is None or target is None or not landing.unjudged:
        return
    run = item.config.stash[RUN]

    def claim(_: Need, facts: UnjudgedFlight) -> UnjudgedFlight:
        return dataclasses.replace(facts, first=run.claims.claim_slot(target, item.nodeid))

    facts = UnjudgedFlight(
        inconclusive=landing.inconclusive,
        alone=target.entry is not None or bool(run.options.repeat),
        expects_failure=item.get_closest_marker("xfail") is not None,
    )
    decision, _ = resolve(facts, claim)
    if decision.outcome == "skipped":
        pytest.skip(landing.unjudged)
    pytest.fail(landing.complaint, pytrace=False)


def report_item(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    error: BaseException | None,
) -> None:
    """Decide the outcome of an item that asked for its landing, and write it into the report."""
    if not isinstance(item, pytest.Function) or LANDING not in item.stash:
        return
    writer = _Writer(
        report=report, item=item, run=run, target=target, result=run.flight(target).result
    )
    if report.failed and error is not None:
        writer.write_failure(error)
    elif report.passed and writer.case is not None:
        writer.write_passing_case(writer.case)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Writer:
    """Gathers the facts of one item, and writes what is decided."""

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
        if failure is not None and self.case is None and not self.result.inconclusive:
            self._note_user_failure(failure)

        def gather(need: Need, facts: FailedItem) -> FailedItem:
            assert failure is not None
            return self._gather(need, facts, failure)

        decision, facts = resolve(self._facts(failure), gather)
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

    def write_passing_case(self, case: Case) -> None:
        """Write the outcome of a saved case whose test passed."""
        state = CaseState(signature=case.violation.signature, status=case.status, edge=case.edge)
        violates = self.result.verdict.primary is not None
        # The fixture ``landing`` has found it out.
        unproven = str(dict(self.item.user_properties).get(UNPROVEN, ""))
        facts = PassedCase(
            case=state,
            violates=violates,
            unproven=bool(unproven),
            strict=self.run.options.xfail_strict,
        )
        decision, _ = resolve(facts, self._claim_slot)
        file = self._case_file
        if decision.outcome == "xfailed":
            return self._expect(report_text.passing_edge(state, file))
        if decision.reason is Reason.STALE:
            self._note(STALE, f"{file} passes, but {unproven}")
        elif decision.reason is Reason.MAYBE_FIXED:
            self._note(MAYBE_FIXED, file)
        if decision.outcome == "failed":
            self.report.outcome = "failed"
            self.report.longrepr = report_text.passing_failure(decision, file, unproven)
        return None

    def _facts(self, failure: ItemFailure | None) -> FailedItem:
        """Return the facts about a failed test that need no flight."""
        if failure is None or self.result.inconclusive:
            return FailedItem(signature="", inconclusive=self.result.inconclusive)
        options, case, entry = self.run.options, self.case, self.target.entry
        state = None
        if case is not None and entry is not None:
            state = CaseState(
                signature=case.violation.signature,
                status=case.status,
                edge=case.edge,
                accepted=options.corpus.is_accepted(entry),
            )
        return FailedItem(
            signature=failure.signature,
            user_property=failure.user_property,
            crashed=self.result.verdict.violation_type == "V",
            case=state,
            expected_by=self.run.expected_signatures(self.target).get(failure.signature, ""),
            repeating=bool(options.repeat),
            duplicates=options.duplicates,
        )

    def _gather(self, need: Need, facts: FailedItem, failure: ItemFailure) -> FailedItem:
        """Add a fact about a failed test that costs flights or an entry in the ledger."""
        run, target, nodeid = self.run, self.target, self.item.nodeid
        match need:
            case Need.EARLIER:
                earlier = first_with_same_signature(run, target, failure, nodeid)
                return dataclasses.replace(facts, earlier=earlier)
            case Need.REFLIGHTS:
                return dataclasses.replace(facts, reflights=refly(run, target, failure))
            case Need.CLAIM:
                faster = run.claims.claim_failure(failure.key(target.search), target.name, nodeid)
                return dataclasses.replace(facts, claimed=True, earlier=faster)

    def _claim_slot(self, need: Need, facts: PassedCase) -> PassedCase:
        assert need is Need.CLAIM
        first = self.run.claims.claim_slot(self.target, self.item.nodeid)
        return dataclasses.replace(facts, first=first)

    def _write_failing_case(
        self, case: Case, failure: ItemFailure, decision: Decision, facts: FailedItem
    ) -> None:
        file = self._case_file
        self._note(CASE, file)
        if decision.outcome == "xfailed":
            return self._expect(report_text.expected_failure(decision, facts, file))
        flown = (failure.signature, self.result.verdict.story)
        return self._fail(report_text.case_text(decision, case, file, self.item.config, flown))

    def _write_violation(self, failure: ItemFailure, decision: Decision, facts: FailedItem) -> None:
        target = self.target
        key = failure.key(target.search)
        if decision.reason is Reason.NOT_REPEATED:
            slot = [target.system_name, target.map, target.name, failure.signature]
            self._note(NOT_REPEATED, json.dumps(slot))
        elif decision.reason is Reason.DUPLICATE:
            self._note(DUPLICATE_OF, key)
        if decision.outcome == "xfailed":
            return self._expect(report_text.expected_failure(decision, facts, ""))
        self._note(REPORTED_FAILURE, key)
        self._note_finding_test(failure)
        verdict = self.result.verdict
        return self._fail(
            report_text.violation_text(
                self.item, self.run, target, failure, verdict, facts.reflights
            )
        )

    def _note_user_failure(self, failure: ItemFailure) -> None:
        """Tell the summary of a failure of the user's own property, whatever is decided."""
        target, failed = self.target, failure.failed_assertion
        if failure.user_property and failed is not None:
            slot = [target.system_name, target.map, target.name]
            self._note(USER_FAILURE, json.dumps([*slot, failure.signature, failed.message]))

    def _note_finding_test(self, failure: ItemFailure) -> None:
        """Remember which test found a violation: it judges the case that is saved."""
        if not failure.savable:
            return
        run, search = self.run, self.target.search
        worker = is_xdist_worker(self.item.config)
        if failure.user_property:
            run.user_assertions[search, failure.signature] = failure.assertion
            if worker:
                self._note(WORKER_ASSERTION, failure.signature)
        run.note_finding_test(search, failure.signature, self.item.nodeid)
        if worker:
            self._note(FINDING_TEST, f"{search} {failure.signature}")

    def _note(self, key: str, value: str) -> None:
        self.report.user_properties.append((key, value))

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
