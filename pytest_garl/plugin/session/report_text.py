"""The text of an item's report: what happened, where and when, and how to see it again."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.severity import Severity
from pytest_garl.messages import command
from pytest_garl.plugin.items.outcomes import CaseState, Decision, FailedItem, Reason, Reflights
from pytest_garl.plugin.items.suggested_commands import repeat_line
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.session.item_facts import ItemFailure, divergence_s
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal_text import width_of, wrapped
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.wording import headline

_CASE_FAILURES = {
    Reason.NEW_CASE: "is new and not accepted yet",
    Reason.FAILS_AGAIN: "was fixed and fails again",
    Reason.FAILS_DIFFERENTLY: "fails in another way",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureText:
    """The text that the report of a failing item gets.

    ``headline`` and ``command`` stand where only one or two lines are shown.
    """

    lines: tuple[str, ...]
    headline: str
    command: str


def expected_failure(decision: Decision, facts: FailedItem, file: str) -> str:
    """Return the reason of an item that is xfailed; ``file`` is its own case's."""
    saved = facts.case.signature if facts.case else ""
    match decision.reason:
        case Reason.EXPECTED:
            return f"known: {facts.signature} ({facts.expected_by})"
        case Reason.DUPLICATE:
            return f"same violation as {facts.earlier} ({facts.signature})"
        case Reason.NOT_REPEATED:
            assert facts.reflights is not None
            return f"did not repeat: {_share(facts.reflights)} ({facts.signature})"
        case Reason.EDGE:
            return f"edge: fails; {saved} ({file})"
        case Reason.OTHER_ENGINE:
            assert facts.case is not None
            why = facts.case.of_another_engine
            return f"another engine: fails by {facts.signature} ({file}; {why})"
        case Reason.NOT_PREVENTABLE_CASE:
            assert facts.case is not None
            return f"{facts.case.reason}: {saved} ({file})"
    return f"known: {saved} ({file})"


def passing_edge(case: CaseState, file: str) -> str:
    """Return the reason of an edge case that passes and is xfailed."""
    return f"edge: passes; {case.signature} ({file})"


def passing_failure(decision: Decision, file: str, unproven: str) -> str:
    """Return the text of an open case that passes and fails for ``garl_xfail_strict``."""
    maybe = f"stale, {unproven}" if decision.reason is Reason.STALE else "maybe fixed"
    return (
        f"{file} is open but passes (garl_xfail_strict): {maybe}; "
        f"if it is fixed: {command('garl', 'cases', 'promote', file)}"
    )


def error_text(item: pytest.Item, target: Target, error: BaseException) -> str:
    """Return the text of a test that raised something else than a failed assertion."""
    cause = f"The test itself raised {type(error).__name__}; that violates no property."
    return f"{cause}\n{repeat_line(item, target)}"


def unjudged_text(result: FlightResult, unjudged: str) -> str:
    """Return the text of a flight without judge, with the landing system's own traceback."""
    if result.inconclusive:
        return (
            f"{unjudged}. Nothing was decided: fly it again while the machine has nothing else to "
            "do, or allow more time with --garl-timeout."
        )
    crash, story = result.crash, result.verdict.story
    return f"{story}\n\n{crash.traceback}" if crash and crash.traceback else story


def inconclusive_text(item: pytest.Item, target: Target, undecided: str) -> FailureText:
    """Return the text of an inconclusive flight."""
    repeat = repeat_line(item, target)
    return FailureText(lines=(repeat,), headline=undecided, command=repeat)


def violation_text(
    item: pytest.Item,
    run: Run,
    target: Target,
    failure: ItemFailure,
    result: FlightResult,
    facts: FailedItem,
) -> FailureText:
    """Return the text of a violation that a search found."""
    verdict = result.verdict
    story = verdict.story
    own = failure.failed_assertion if failure.user_property else None
    lines = [f"{failure.signature}: a property of your own" if own else failure.signature]
    if not failure.savable:
        lines.append(
            "It is not saved: its test is asynchronous, or takes other fixtures than landing and "
            "scenario."
        )
    elif own and verdict.primary is not None:
        lines.append("It is saved only if it also fails in a flight that violates nothing else.")
    told = "" if own or result.severity is None else _unusual(result.severity)
    remarks = [
        *([told] if told else []),
        *_scenario(item.config, run, target),
        *_doubts(run, target, facts.reflights),
        *([facts.unexcused] if facts.unexcused else []),
    ]
    repeat = repeat_line(item, target)
    lines += [*_wrapped(remarks if own else [story, *remarks], item.config), repeat]
    return FailureText(
        lines=tuple(lines), headline=own.message if own else headline(story), command=repeat
    )


def _unusual(severity: Severity) -> str:
    from pytest_garl.cases.description import unusual_in_flight

    return unusual_in_flight(severity)


def case_text(
    decision: Decision, case: Case, file: str, config: pytest.Config, flown: tuple[str, str]
) -> FailureText:
    """Return the text of a case that fails; ``flown`` are the flight's signature and story."""
    signature, story = flown
    state = _CASE_FAILURES[decision.reason]
    paragraphs = [
        f"Saved: {case.violation.signature}. {case.violation.description}",
        f"Flown: {signature}. {story}",
    ]
    replay = f"See it: {command('garl', 'cases', 'replay', file)}"
    # The first line holds a path, so it is not wrapped.
    lines = [f"The case {file} {state}.", *_wrapped(paragraphs, config), replay]
    if decision.reason is Reason.NEW_CASE:
        accept = command("garl", "cases", "accept", file)
        lines.append(f"If that is known: commit it, or: {accept}")
    if decision.reason is Reason.FAILS_DIFFERENTLY and not case.assertion:
        take = command("garl", "cases", "shrink", "--as-it-fails", file)
        lines.append(f"If it is no worse than before, make it a case of that: {take}")
    # The event comes first because pytest cuts the line at its end.
    return FailureText(
        lines=tuple(lines), headline=f"{headline(story)}; this case {state}", command=replay
    )


def _doubts(run: Run, target: Target, reflights: Reflights | None) -> list[str]:
    """Return what makes a violation doubtful although it repeats."""
    if reflights is None or reflights.same or reflights.flown == 1:
        return []
    share = _share(reflights)
    doubts = [f"{share}, each time" if reflights.failed == reflights.flown else f"FLAKY: {share}"]
    if target.deterministic:
        apart_s = divergence_s(run, target)
        when = "" if apart_s is None else f", from {apart_s:.2f} s on"
        doubts.append(
            "Nondeterministic landing system: the same flight, flown again, took other "
            f"trajectories{when}. Seed its random generators in reset(mission) and read no clock, "
            "or mark it deterministic=False; otherwise its violations cannot be gated."
        )
    return doubts


def _scenario(config: pytest.Config, run: Run, target: Target) -> list[str]:
    """Return the scenario in physical units if ``-v`` is given."""
    if config.get_verbosity() < 1:
        return []
    from pytest_garl.cases.description import scenario_in_words

    scenario = run.scenario(target)
    policy = run.searches.policy_name(target)
    words = scenario_in_words(scenario, run.options.map_folders, policy)
    return [f"Scenario (seed {scenario.seed}): {words}"]


def _share(reflights: Reflights) -> str:
    """Return the share of failing flights in words, with its 95 % interval."""
    low, high = share_interval(reflights.failed, reflights.flown)
    share = f"{reflights.failed} of {reflights.flown} flights fail"
    return f"{share} [{100 * low:.0f}, {100 * high:.0f}] %"


def _wrapped(paragraphs: list[str], config: pytest.Config) -> list[str]:
    width = width_of(config)
    return [wrapped(text, width, others="  ") for text in paragraphs]
