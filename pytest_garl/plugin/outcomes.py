"""What a failing item says: what happened, where and when, and how to see it again."""

from __future__ import annotations

import json

import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.plugin.case_outcomes import explain_failing, explain_passing
from pytest_garl.plugin.faults import Fault, Repeats, fault_of, repeats, told_by, write_down
from pytest_garl.plugin.keys import EXCUSED, FAILURE, FOUND, OWN, UNREPEATED, is_xdist_worker
from pytest_garl.plugin.report_edits import expect, paragraphs, tell
from pytest_garl.plugin.run import Run, reflight_key
from pytest_garl.plugin.suggested_commands import repeat_line
from pytest_garl.plugin.target import FIRST, Target
from pytest_garl.verdicts.wording import headline

OWN_FAILURE = "garl.own_failure"
"""The user property by which the summary learns of a test's own assertion that failed."""


def explain(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    error: BaseException | None,
) -> None:
    """Add the story to a failing report; turn what is known, or told already, into an xfail."""
    result = run.ledger.result(target.search, target.slot.generation, target.slot.index)
    if result is None or not isinstance(item, pytest.Function):
        return
    case = target.entry.case if target.entry is not None else None
    if report.failed and error is not None:
        fault = fault_of(item, target, result, error)
        again = repeat_line(item, target)
        if fault is None:
            lines = [f"The test itself raised {type(error).__name__}; that violates no property."]
            report.sections.append(("garl: what happened", "\n".join([*lines, again])))
        elif result.inconclusive:
            tell(report, [again], result.undecided, again)
        elif case is not None:
            explain_failing(report, item, run, target, case, fault, result)
        else:
            _explain_fault(report, item, run, target, fault, result)
    elif report.passed and case is not None:
        explain_passing(report, item, run, target, case, result)


def _explain_fault(
    report: pytest.TestReport,
    item: pytest.Function,
    run: Run,
    target: Target,
    fault: Fault,
    result: FlightResult,
) -> None:
    """Report what a search found, unless it is known, was told already, or does not repeat."""
    _note_own(report, target, fault)
    known = run.expected_signatures(target).get(fault.signature)
    if known is not None:
        return expect(report, f"known: {fault.signature} ({known})")
    first_with_same_signature = told_by(run, target, fault, item.nodeid)
    doubts: list[str] = []
    if not first_with_same_signature and not run.options.repeat:
        found = repeats(run, target, fault)
        if not found.holds:
            unrepeated = [target.system_name, target.map, target.name, fault.signature]
            report.user_properties.append((UNREPEATED, json.dumps(unrepeated)))
            return expect(report, f"did not repeat: {found.share} ({fault.signature})")
        doubts = _doubts(run, target, found)
        first_with_same_signature = write_down(run, target, fault, item.nodeid)
    if first_with_same_signature and run.options.duplicates == "xfail":
        report.user_properties.append((EXCUSED, fault.key(target.search)))
        return expect(report, f"same violation as {first_with_same_signature} ({fault.signature})")
    report.user_properties.append((FAILURE, fault.key(target.search)))
    _note_test(report, item, run, target, fault)
    lines = [f"{fault.signature}: a property of your own" if fault.own else fault.signature]
    if fault.own and not fault.user_assertion.runs_on_any_flight:
        lines.append("It is not saved: its test takes more than landing and scenario.")
    elif fault.own and result.verdict.primary is not None:
        lines.append("It is saved only if it fails in a flight that violates nothing else, too.")
    story = result.verdict.story
    told = [*_unusual(item.config, run, target), *doubts]
    what = fault.failure.message if fault.own and fault.failure else headline(story)
    again = repeat_line(item, target)
    lines += [*paragraphs(told if fault.own else [story, *told], item), again]
    return tell(report, lines, what, again)


def _note_own(report: pytest.TestReport, target: Target, fault: Fault) -> None:
    """Tell the summary of a property of the user's own, whatever becomes of its failure."""
    if fault.own and fault.failure:
        told = [target.system_name, target.map, target.name]
        told += [fault.signature, fault.failure.message]
        report.user_properties.append((OWN_FAILURE, json.dumps(told)))


def _note_test(
    report: pytest.TestReport, item: pytest.Item, run: Run, target: Target, fault: Fault
) -> None:
    """Remember which test found a violation: it judges the case that is saved."""
    if fault.own and not fault.user_assertion.runs_on_any_flight:
        return
    worker = is_xdist_worker(item.config)
    if fault.own:
        run.user_assertions[target.search, fault.signature] = fault.user_assertion
        if worker:
            report.user_properties.append((OWN, fault.signature))
    run.note_finding_test(target.search, fault.signature, item.nodeid)
    if worker:
        report.user_properties.append((FOUND, f"{target.search} {fault.signature}"))


def _doubts(run: Run, target: Target, found: Repeats) -> list[str]:
    """Return what is doubtful about a violation that shows again."""
    if found.same or found.flown == 1:
        return []
    told = [f"FLAKY: {found.share}" if found.failed < found.flown else f"{found.share}, each time"]
    if target.deterministic:
        told.append(
            "Nondeterministic landing system: the same flight again came to other trajectories"
            f"{_parting(run, target)}. Seed its generators in reset(mission) and read no clock, or "
            "mark it deterministic=False; what is found cannot be gated otherwise."
        )
    return told


def _parting(run: Run, target: Target) -> str:
    """Say when two flights of a slot part, where both were recorded."""
    from pytest_garl.execution.slot import flight_name
    from pytest_garl.simulation.flight_file import load, parted_s

    slot = target.slot
    names = (
        flight_name(target.search, slot.generation, slot.index, target.map),
        flight_name(reflight_key(target, 0), FIRST.generation, FIRST.index, target.map),
    )
    files = [run.options.folder / "flights" / f"{name}.npz" for name in names]
    if not all(file.exists() for file in files):
        return ""
    first, second = (load(file) for file in files)
    return f", from {parted_s(first, second):.2f} s on"


def _unusual(config: pytest.Config, run: Run, target: Target) -> list[str]:
    """Return with ``-v`` what the scenario holds, in physical units."""
    if config.get_verbosity() < 1:
        return []
    from pytest_garl.regressions.description import meanings

    scenario = run.scenario(target)
    words = [
        meaning if what.startswith("environment.") else f"{what} {meaning}"
        for what, _, meaning in meanings(scenario, run.options.map_folders)
    ]
    return [f"Scenario (seed {scenario.seed}): {'; '.join(words)}"]
