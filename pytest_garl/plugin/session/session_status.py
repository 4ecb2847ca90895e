"""Decide the exit status of a session, and say why it fails although no item does.

No other module sets ``session.exitstatus``; a session that cannot go on ends by ``pytest.exit``.
"""

from __future__ import annotations

import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.messages import shortened
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.session.tally import Tally
from pytest_garl.plugin.terminal_text import counted, listed
from pytest_garl.reports.run_record import SearchRecord

FLIGHTS_PER_EXCEPTION = 20
"""One in this many flights may be inconclusive, and one in as many may fail only once."""
_ASK_FOR_FLIGHTS = ("budget", "map", "repeat")
"""Options of the command line that ask a session for flights, whatever its tests are."""
MESSAGE_CHARS = 300
"""Characters of an unexpected error's message that a line shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFacts:
    """Facts that decide the exit status of a session, beside its items."""

    nothing_compared: bool = False
    """Whether the command line asks for a gate and none was flown."""
    interrupted: bool = False
    """Whether somebody interrupted the work that follows the tests."""
    broken: bool = False
    """Whether the ledger was lost, or cases could not be saved."""
    problems: bool = False
    """Whether :func:`problems` found any."""


def exit_status(status: int, facts: SessionFacts) -> int:
    """Return the exit status of a session that would end with ``status``."""
    if facts.broken:
        return pytest.ExitCode.INTERNAL_ERROR
    passes = (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED)
    if facts.nothing_compared and status in passes:
        return pytest.ExitCode.USAGE_ERROR
    if facts.interrupted and status in (*passes, pytest.ExitCode.TESTS_FAILED):
        return pytest.ExitCode.INTERRUPTED
    if facts.problems and status == pytest.ExitCode.OK:
        return pytest.ExitCode.TESTS_FAILED
    return status


def set_exit_status(
    session: pytest.Session,
    run: Run | None,
    tally: Tally | None,
    options: Options,
    *,
    nothing_compared: bool,
) -> None:
    """Note the problems of a session in its tally, and set its exit status."""
    broken = run is not None and bool(run.save_problem)
    if tally is not None:
        try:
            tally.stopped = session.exitstatus != pytest.ExitCode.OK and not tally.tests_ran
            tally.problems = list(problems(tally, run, options))
        except Exception as error:  # noqa: BLE001 (the summary, which follows, says what it was)
            broken = True
            tally.problems = [problem_text("this list", error)]
    facts = SessionFacts(
        nothing_compared=nothing_compared,
        interrupted=run is not None and run.interrupted,
        broken=broken,
        problems=tally is not None and bool(tally.problems),
    )
    session.exitstatus = exit_status(session.exitstatus, facts)


def fail_broken_session(config: pytest.Config) -> None:
    """Let a session fail whose summary, the last that pytest does, could not be written."""
    session: Any = config.pluginmanager.get_plugin("session")
    session.exitstatus = exit_status(session.exitstatus, SessionFacts(broken=True))


def problem_text(part: str, error: Exception) -> str:
    """Return one line about an error that a part of a session's end met."""
    if isinstance(error, GarlError):
        return str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    message = shortened(str(error), MESSAGE_CHARS)
    return (
        f"{part} is not complete because of an error in pytest-garl, please report it: "
        f"{type(error).__name__}: {message} ({last.filename}:{last.lineno})"
    )


def problems(tally: Tally, run: Run | None, options: Options) -> Iterator[str]:
    """Yield why the session fails, beside its items."""
    excused = [] if tally.stopped else tally.wrongly_excused()
    if excused:
        yield (
            f"{counted(len(excused), 'test')} excused by a failure that no test shows (its test "
            f"was skipped, passed or was expected to fail): {listed(excused)}"
        )
    if run is not None and run.options.searches_or_repeats:
        searches = tally.run_record(run).searches
        yield from _inconclusive(searches)
        yield from _unrepeated(tally, searches)
        if not run.options.repeat:
            yield from _without_landing(searches)
    if _flights_were_asked_for(tally, options) and not tally.flown:
        yield f"nothing was flown, although flights were asked for: {_why_nothing_flew(tally)}"
    if options.unasserted == "fail":
        for text in _hidden(tally):
            yield f"{text} (garl_unasserted = note makes this a note)"


def notes(tally: Tally) -> Iterator[str]:
    """Yield what a green session leaves open."""
    if tally.items and not tally.flown and not any(each.gate_report for each in tally.records):
        yield f"nothing was flown: {_why_nothing_flew(tally)}"
    yield from _hidden(tally)
    for search in tally.record.searches if tally.record else ():
        if not search.landed and not search.held:
            yield f"{search.name}: landed in none of {counted(search.flown, 'flight')}"
    for name, slots in _unrepeated_by_search(tally).items():
        violations = counted(len(slots), "violation")
        yield f"{name}: {violations} did not repeat: {listed(slots)}"


def _flights_were_asked_for(tally: Tally, options: Options) -> bool:
    """Whether this session was to fly; an ini key's budget asks only sessions of landing tests."""
    if tally.items:
        return options.searches_or_repeats or "map" in options.given
    return tally.tests_ran and not options.given.isdisjoint(_ASK_FOR_FLIGHTS)


def _hidden(tally: Tally) -> Iterator[str]:
    """Yield what was found without a failure that pytest reports."""
    if tally.stopped:
        return
    if tally.unasserted:
        kinds = [f"{name} ({counted(n, 'flight')})" for name, n in tally.unasserted.most_common()]
        yield f"no selected test fails for these violations: {', '.join(kinds)}"
    if tally.hidden:
        found = [f"{nodeid} ({text})" for nodeid, text in sorted(tally.hidden.items())]
        yield (
            f"{counted(len(found), 'failure')} hidden by a mark xfail or by a hook: {listed(found)}"
        )


def _why_nothing_flew(tally: Tally) -> str:
    if not tally.items:
        return "no test that ran takes the fixture 'landing'"
    reasons = [reason for reason, _ in tally.no_flight.most_common()]
    return "; ".join(reasons) or "all landing tests were skipped before they asked for a landing"


def _inconclusive(searches: Sequence[SearchRecord]) -> Iterator[str]:
    """Yield which searches have too many inconclusive flights."""
    for search in searches:
        slots, flown = search.inconclusive, search.flown
        allowed = flown // FLIGHTS_PER_EXCEPTION
        if len(slots) > allowed:
            yield (
                f"{search.name}: {len(slots)} of {flown} flights are inconclusive, "
                f"at most {allowed} may be: {listed(slots)}. {_why_inconclusive(search)}"
            )


def _why_inconclusive(search: SearchRecord) -> str:
    """Return why flights are inconclusive if they came to an end, else what helps."""
    results = [each.result for each in search.flights if each.result.inconclusive]
    reasons = Counter(each.undecided for each in results if each.undecided and not each.crash)
    if reasons:
        ((reason, _),) = reasons.most_common(1)
        return f"{reason[:1].upper()}{reason[1:]}"
    return (
        "Fly them while the machine has nothing else to do, or allow more time with --garl-timeout"
    )


def _without_landing(searches: Sequence[SearchRecord]) -> Iterator[str]:
    """Yield in which searches no flight landed within the limits, whatever is known of them."""
    for search in searches:
        if search.completed_well:
            continue
        flown = counted(search.flown, "flight")
        yield (
            f"{search.name}: held its place, and in none of {flown} was the marker its target "
            "without a violation"
            if search.held
            else f"{search.name}: landed within the limits in none of {flown}, so nothing shows "
            "that it can land"
        )


def _unrepeated(tally: Tally, searches: Sequence[SearchRecord]) -> Iterator[str]:
    """Yield which searches have too many violations that did not repeat."""
    flown = {search.name: search.flown for search in searches}
    for name, slots in _unrepeated_by_search(tally).items():
        flights = flown.get(name, 0)
        allowed = max(1, flights // FLIGHTS_PER_EXCEPTION)
        if len(slots) > allowed:
            yield (
                f"{name}: {len(slots)} violations in {flights} flights did not "
                f"repeat, at most {allowed} may: {listed(slots)}"
            )


def _unrepeated_by_search(tally: Tally) -> dict[str, list[str]]:
    """Return the slots of each search with violations that did not repeat, by its name."""
    found: dict[str, set[str]] = {}
    for each in sorted(tally.records, key=lambda each: (each.system, each.map)):
        if each.not_repeated:
            slots = found.setdefault(tally.search_name(each), set())
            slots.add(f"{each.slot} ({each.failure_signature})")
    return {search: sorted(slots) for search, slots in found.items()}
