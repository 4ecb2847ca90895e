"""What the item of a saved case says: whether it fails as it did, in another way, or not at all."""

from __future__ import annotations

import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.faults import Fault
from pytest_garl.plugin.report_edits import expect, paragraphs, tell
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.suggested_commands import shown
from pytest_garl.plugin.target import Target
from pytest_garl.regressions.case import Case
from pytest_garl.verdicts.wording import headline

CASE = "garl.case"
"""The user property that names the file of a case that fails."""
MAYBE_FIXED = "garl.maybe_fixed"
"""The user property that names the file of an open case that passes."""
STALE = "garl.stale"
"""The user property that names the file of one that passes without proof, and tells why."""


def explain_failing(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    case: Case,
    fault: Fault,
    result: FlightResult,
) -> None:
    """Judge a case that fails: an open one may fail as it did before, a fixed one must not."""
    assert target.entry is not None
    verdict, file = result.verdict, shown(target.entry.path, item.config)
    report.user_properties.append((CASE, file))
    signature = case.violation.signature
    same = fault.signature == signature
    # Who cannot be avoided may be met in any way; that excuses nothing that the case is not about.
    excuses = same or not (fault.own or verdict.violation_type == "V")
    if case.edge and excuses:
        return expect(report, f"edge: fails; {signature} ({file})")
    expected = (same and case.status == "open") or (excuses and case.status == "unavoidable")
    if expected and run.options.corpus.is_accepted(target.entry):
        word = "known" if case.status == "open" else "unavoidable"
        return expect(report, f"{word}: {signature} ({file})")
    other = run.expected_signatures(target).get(fault.signature) if fault.own and not same else None
    if other is not None:
        return expect(report, f"known: {fault.signature} ({other})")
    if expected:
        state = "is new and not accepted yet"
    elif case.status == "fixed":
        state = "was fixed and fails again"
    else:
        state = "fails in another way"
    told = [
        f"Saved: {signature}. {case.violation.story}",
        f"Flown: {fault.signature}. {verdict.story}",
    ]
    again = f"See it: garl cases replay {file}"
    # The first line, which holds a path, is left whole.
    lines = [f"The case {file} {state}.", *paragraphs(told, item), again]
    if expected:
        lines.append(f"If that is known: commit it, or: garl cases accept {file}")
    # What happened comes first, as pytest cuts the line at the end.
    return tell(report, lines, f"{headline(verdict.story)}; this case {state}", again)


def explain_passing(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    case: Case,
    result: FlightResult,
) -> None:
    """Say that an open case passes; once, where that is to fail the run."""
    assert target.entry is not None
    file = shown(target.entry.path, item.config)
    if case.edge:
        return expect(report, f"edge: passes; {case.violation.signature} ({file})")
    if case.status != "open" or result.verdict.primary is not None:
        return None
    stale = "; ".join(run.unproven(target))
    said = (STALE, f"{file} passes, but {stale}") if stale else (MAYBE_FIXED, file)
    report.user_properties.append(said)
    if run.options.xfail_strict and run.reports_first(target, item.nodeid):
        maybe = f"stale, {stale}" if stale else "maybe fixed"
        report.outcome = "failed"
        report.longrepr = (
            f"{file} is open but passes (garl_xfail_strict): {maybe}; "
            f"if it is fixed: garl cases promote {file}"
        )
    return None
