"""What a failing item says: what happened, where and when, and how to see it again."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.fixtures import Landing
from pytest_garl.own import Asks, failure_of
from pytest_garl.reports.commands import repeat_line, shown
from pytest_garl.reports.wrapping import width_of, wrapped
from pytest_garl.run import Run, again_key
from pytest_garl.switches import FOUND, OWN
from pytest_garl.targets import FIRST, Target, name_of
from pytest_garl.verdicts.headline import headline

if TYPE_CHECKING:
    from pytest_garl.regressions.case import Case

AGAIN = 4
"""How often a violation of a system that need not be deterministic is flown once more."""
MAYBE_FIXED = "garl.maybe_fixed"
"""The user property that names the file of an open case that passes."""
OWN_FAILURE = "garl.own_failure"
"""The user property by which the summary learns of a test's own assertion that failed."""
STALE = "garl.stale"
"""The user property that names the file of one that passes without proof, and tells why."""


def crash_text(landing: Landing) -> str:
    """Return the landing system's own traceback, or the story where there is none."""
    crash: dict[str, Any] | None = landing.result["crash"]
    story = landing.verdict.story
    return f"{story}\n\n{crash['traceback']}" if crash and crash["traceback"] else story


def explain(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    error: BaseException | None,
) -> None:
    """Add the story to a failing report; turn a known violation into an xfail."""
    result = run.ledger.result(target.search, target.slot.generation, target.slot.index)
    if result is None:
        return
    if target.entry is not None and target.entry.case is not None:
        _explain_case(report, item, run, target, target.entry.case, result, error)
    elif report.failed and result["verdict"]["primary"] is not None:
        _explain_violation(report, item, run, target, result)
    elif report.failed and isinstance(item, pytest.Function) and error is not None:
        _explain_own(report, item, run, target, error)


def _explain_violation(
    report: pytest.TestReport, item: pytest.Item, run: Run, target: Target, result: dict[str, Any]
) -> None:
    signature = result["verdict"]["signature"]
    known = run.known(target).get(signature)
    if known is not None:
        return _expected(report, f"known: {signature} ({known})")
    twin = run.twin(target, lambda _, other: other["verdict"]["signature"] == signature)
    if twin and run.options.duplicates == "xfail":
        return _expected(report, f"same violation as {twin} ({signature})")
    doubt = "" if twin or run.options.repeat else _doubt(run, target, result)
    if doubt.startswith(FLAKY):
        return _expected(report, doubt)
    _note_test(report, item, run, target, signature)
    story = result["verdict"]["story"]
    told = [story, *_unusual(item.config, run, target), *filter(None, [doubt])]
    again = repeat_line(item, target)
    return _tell(report, [signature, *_wrapped(told, item), again], headline(story), again)


def _explain_own(
    report: pytest.TestReport, item: pytest.Function, run: Run, target: Target, error: BaseException
) -> None:
    """Treat a test's own assertion, where the built-in verdict is content, as another violation."""
    failure = failure_of(item.originalname, error)
    if failure is None:
        return None
    told = [name_of(target.system), target.map, target.name, failure.signature, failure.message]
    report.user_properties.append((OWN_FAILURE, json.dumps(told)))
    known = run.known(target).get(failure.signature)
    if known is not None:
        return _expected(report, f"known: {failure.signature} ({known})")
    asks = Asks(item, target)
    again = repeat_line(item, target)
    lines = [f"{failure.signature}: a property of your own", again]
    if not asks.possible:
        lines.insert(1, "It is not saved: its test takes more than landing and scenario.")
        return _tell(report, lines, failure.message, again)

    def alike(other: Target, result: dict[str, Any]) -> bool:
        found = asks(result, run.record(other), run.scenario(other))
        return found is not None and found.signature == failure.signature

    twin = run.twin(target, alike)
    if twin and run.options.duplicates == "xfail":
        return _expected(report, f"same violation as {twin} ({failure.signature})")
    run.own[target.search, failure.signature] = asks
    _note_test(report, item, run, target, failure.signature)
    if hasattr(item.config, "workerinput"):
        report.user_properties.append((OWN, failure.signature))
    return _tell(report, lines, failure.message, again)


def _note_test(
    report: pytest.TestReport, item: pytest.Item, run: Run, target: Target, signature: str
) -> None:
    """Remember which test found a violation; it judges the case that is saved."""
    run.note_test(target.search, signature, item.nodeid)
    if hasattr(item.config, "workerinput"):
        report.user_properties.append((FOUND, f"{target.search} {signature}"))


def _explain_case(
    report: pytest.TestReport,
    item: pytest.Item,
    run: Run,
    target: Target,
    case: Case,
    result: dict[str, Any],
    error: BaseException | None,
) -> None:
    """Judge a case: an open one fails as it did before, a fixed one must not fail."""
    assert target.entry is not None
    verdict, file = result["verdict"], shown(target.entry.path, item.config)
    same = verdict["signature"] == case.violation.signature
    if case.edge:
        # What else a test raises is a mistake in the test.
        if report.passed or isinstance(error, AssertionError | pytest.fail.Exception):
            ends = "fails" if report.failed else "passes"
            _expected(report, f"edge: {ends}; {case.violation.signature} ({file})")
        return None
    if report.failed:
        known = run.acceptance.covers(target.entry.path, case)
        as_saved = case.status == "open" and (same or _same_assertion(case, item, error))
        if case.status == "unavoidable" and known:
            return _expected(report, f"unavoidable: {case.violation.signature} ({file})")
        if as_saved and known:
            return _expected(report, f"known: {case.violation.signature} ({file})")
        if as_saved or case.status == "unavoidable":
            state = "is new and not accepted yet"
        elif case.status == "fixed":
            state = "was fixed and fails again"
        else:
            state = "fails in another way"
        told = [
            f"The case {file} {state}.",
            f"Saved: {case.violation.signature}. {case.violation.story}",
            f"Flown: {verdict['signature'] or 'no violation of its own'}. {verdict['story']}",
        ]
        again = f"See it: garl cases replay {file}"
        lines = [*_wrapped(told, item), again]
        if as_saved or (case.status == "unavoidable" and not known):
            lines.append(f"If that is known: commit it, or: garl cases accept {file}")
        return _tell(report, lines, f"{state}: {headline(verdict['story'])}", again)
    first = run.first_item(target) == item.nodeid
    if report.passed and case.status == "open" and verdict["primary"] is None and first:
        stale = "; ".join(run.unproven(target))
        said = (STALE, f"{file} passes, but {stale}") if stale else (MAYBE_FIXED, file)
        report.user_properties.append(said)
        if run.options.xfail_strict:
            maybe = f"stale, {stale}" if stale else "maybe fixed"
            report.outcome = "failed"
            report.longrepr = (
                f"{file} is open but passes (garl_xfail_strict): {maybe}; "
                f"if it is fixed: garl cases promote {file}"
            )
    return None


def _same_assertion(case: Case, item: pytest.Item, error: BaseException | None) -> bool:
    """Whether a case's own test fails in the assertion that it was saved for."""
    if not case.assertion or error is None or not isinstance(item, pytest.Function):
        return False
    failure = failure_of(item.originalname, error)
    return failure is not None and failure.signature == case.violation.signature


FLAKY = "FLAKY"


def _doubt(run: Run, target: Target, result: dict[str, Any]) -> str:
    """Fly a new violation again; return what is doubtful about it, or nothing."""
    if target.deterministic:
        _, hashes = run.again(target, 1)
        if hashes[0] == run.trajectory_sha256(target):
            return ""
        return (
            "Nondeterministic landing system: the same flight again came to other trajectories"
            f"{_parting(run, target)}. Seed its generators in reset(mission) and read no clock, or "
            "mark it deterministic=False; what is found cannot be gated otherwise."
        )
    from pytest_garl.verdicts.metrics import share_interval

    results, _ = run.again(target, AGAIN)
    failed = 1 + sum(each["verdict"]["primary"] is not None for each in results)
    low, high = share_interval(failed, 1 + AGAIN)
    share = f"{failed} of {1 + AGAIN} flights fail [{100 * low:.0f}, {100 * high:.0f}] %"
    if failed == 1 + AGAIN:
        return f"Fails each time: {share}."
    return f"{FLAKY}: {share} ({result['verdict']['signature']})"


def _parting(run: Run, target: Target) -> str:
    """Say when two flights of a slot part, where both were recorded."""
    from pytest_garl.search.slots import flight_name
    from pytest_garl.simulation.record import load, parted_s

    slot = target.slot
    names = (
        flight_name(target.search, slot.generation, slot.index, target.map),
        flight_name(again_key(target, 0), FIRST.generation, FIRST.index, target.map),
    )
    files = [run.options.folder / "flights" / f"{name}.npz" for name in names]
    if not all(file.exists() for file in files):
        return ""
    first, second = (load(file) for file in files)
    return f", from {parted_s(first, second):.2f} s on"


def _expected(report: pytest.TestReport, reason: str) -> None:
    report.outcome = "skipped"
    report.wasxfail = reason


def _tell(report: pytest.TestReport, lines: list[str], what: str, again: str) -> None:
    """Add lines to a failure; say what happened, and how to see it, where one line is shown."""
    report.sections.append(("garl: what happened", "\n".join(lines)))
    crash = getattr(report.longrepr, "reprcrash", None)
    if crash is not None:
        # The short summary shows the first line, JUnit's message as many as fit.
        crash.message = f"{what}\n{again}"


def _wrapped(told: list[str], item: pytest.Item) -> list[str]:
    width = width_of(item.config)
    return [wrapped(text, width, others="  ") for text in told]


def _unusual(config: pytest.Config, run: Run, target: Target) -> list[str]:
    """Return with ``-v`` what the scenario holds, in physical units."""
    if config.get_verbosity() < 1:
        return []
    from pytest_garl.regressions.story import meanings

    scenario = run.scenario(target)
    words = [
        meaning if what.startswith("environment.") else f"{what} {meaning}"
        for what, _, meaning in meanings(scenario, run.options.map_folders)
    ]
    return [f"Scenario (seed {scenario.seed}): {'; '.join(words)}"]
