"""After the tests: confirm, shrink and save the violations that a search found, and report them."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.errors import GarlError
from pytest_garl.messages import command
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.items.user_assertions import collect_assertion
from pytest_garl.plugin.options import SHRINK
from pytest_garl.plugin.session.probe_items import probe_requests
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.kind_news import write_last_news
from pytest_garl.plugin.terminal.progress import show_progress
from pytest_garl.plugin.terminal_text import begin_line, counted, duration, width_of, wrapped
from pytest_garl.plugin.xdist import is_xdist_worker
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.triage.follow_up import InvestigatedSignature, follow_up
from pytest_garl.triage.investigation_queue import Investigations

_PATCH = ".patch"


def may_save(run: Run, session: pytest.Session) -> bool:
    """Return whether a search ended in this process, so that its violations may be saved."""
    return run.investigations is not None and _has_ended(run, session)


def save_archive(run: Run, session: pytest.Session) -> None:
    """Write what the searches know for later ones, if they have ended in this process."""
    options = run.options
    if options.archive is None or options.repeat or not options.budget:
        return
    if _has_ended(run, session):
        run.archive.with_ledger(run.ledger).save(options.archive)


def _has_ended(run: Run, session: pytest.Session) -> bool:
    """Return whether all flights of the searches are flown, and this process ends the run."""
    worker = is_xdist_worker(session.config)
    ended = session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)
    stopped = bool(session.shouldfail or session.shouldstop)
    if not (ended and run.loop_finished) or stopped or worker:
        return False
    # After a second Ctrl-C pytest still has the status with which it began.
    return all(each.flown >= each.total for each in run.ledger.queries.progress())


def save_cases(run: Run, session: pytest.Session) -> None:
    """Confirm, shrink and save each new signature; ``run.investigated`` keeps the results."""
    config, investigations = session.config, run.investigations
    assert investigations is not None
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    try:
        _collect_reported_failures(run, session)
        found = investigations.requests(run.user_assertions)
        probed = probe_requests(run.ledger, run.options.shrink)
        requests = (*found, *probed)
        if requests:
            begin_line(reporter)
            reporter.write_line(_announcement(run, investigations, found, probed))
        with show_progress(run, config):
            for each in follow_up(
                investigations, requests, run.finding_tests, _saver(run), run.on_wait
            ):
                run.investigated = (*run.investigated, each)
        write_last_news(run, config)
    except KeyboardInterrupt:
        run.interrupted = True
        begin_line(reporter)
        reporter.write_line(
            "garl: interrupted before everything was saved; the same command with --garl-resume "
            "goes on"
        )
    except GarlError as error:
        begin_line(reporter)
        reporter.write_line(f"garl: {error}", red=True)
        run.save_problem = str(error)


def _announcement(
    run: Run,
    investigations: Investigations,
    found: Sequence[CaseRequest],
    probed: Sequence[CaseRequest],
) -> str:
    """Return how much is left to confirm and shrink; ``run.remaining`` keeps it.

    A kind that probes found is not new for the search, which may have found the same.
    """
    requests = (*found, *probed)
    work = investigations.remaining(requests, _flight_s(run, requests))
    run.remaining = work
    noted = [each for each in found if each.finding]
    new = len(found) - len(noted)
    kinds = [f"{counted(new, 'new kind')} of violation"] if new else []
    kinds += [f"{counted(len(noted), 'kind')} that no test fails for"] if noted else []
    kinds += [f"{counted(len(probed), 'kind')} of failed probes"] if probed else []
    beside = f", {done} done beside the search" if (done := investigations.ended) else ""
    return (
        f"garl: confirming and shrinking {', '.join(kinds)}{beside}, "
        f"at most {counted(work.at_most, 'flight')}, about {duration(work.seconds)}"
    )


def _collect_reported_failures(run: Run, session: pytest.Session) -> None:
    """Collect the users' assertions that failed in xdist's workers."""
    for nodeid, signature in sorted(run.reported_failures.items()):
        target, user_assertion = collect_assertion(session, nodeid)
        run.user_assertions[target.search, signature] = user_assertion


def _saver(run: Run) -> Callable[[Case], Path | None]:
    """Return the function that saves a case: as a file, or in CI as a patch."""
    options = run.options
    if not os.environ.get("CI"):
        return run.corpus.save
    # A build server deletes the tree after the run; a patch can be kept.
    patches = options.folder / "patches"
    return functools.partial(run.corpus.save_patch, patches=patches, root=options.root)


def _flight_s(run: Run, requests: Sequence[CaseRequest]) -> dict[str, float]:
    """Return how long a flight of each signature took in the search."""
    measured = run.ledger.queries.seconds_by_signature()
    average_s = run.ledger.queries.seconds_per_flight() or 0.0
    return {
        each.name: measured.get((each.search, each.signature)) or average_s for each in requests
    }


def saved_lines(run: Run, config: pytest.Config) -> list[str]:
    """Return the summary's lines about saved cases."""
    investigated, width = run.investigated, width_of(config)
    lines = [line for each in investigated for line in _lines_about(each, config, width)]
    files = [each.file for each in investigated if each.file is not None]
    patches = [command(shown_path(file, config)) for file in files if file.suffix == _PATCH]
    if patches:
        lines.append("Nothing in the tree was changed (CI is set). To keep the cases:")
        lines.append(" \\\n        ".join(["    git apply", *patches]))
    elif files:
        gating = [each.file for each in investigated if each.result.case and each.result.case.gates]
        lines += _begin_with([file for file in gating if file is not None], config)
        hint = (
            "New cases that gate fail until they are fixed, committed, or accepted with `garl "
            "cases accept FILE`."
        )
        lines.append(wrapped(hint, width))
    shrink = None if run.options.shrink_capped else run.options.shrink
    return [*lines, *_not_shrunk(investigated, shrink, width)]


def _begin_with(gating: Sequence[Path], config: pytest.Config) -> list[str]:
    """Return which case to look at first: of those that gate the one of the most frequent kind."""
    if not gating:
        return []
    show = command("garl", "cases", "show", shown_path(gating[0], config))
    film = command("garl", "film", gating[0].stem)
    return ["To begin with the first case that gates:", f"    {show}", f"    {film}"]


def _lines_about(each: InvestigatedSignature, config: pytest.Config, width: int) -> list[str]:
    """Return the file of a case and its description, or why nothing was saved."""
    case = each.result.case
    where = f"{each.system.split(':')[-1]} on {each.map}"
    name = f"{where}: {each.result.signature}"
    if case is None and each.result.finding:
        return [f"not saved: {where}: {_seen(each)}; {each.result.reason}"]
    if case is None:
        return [f"not saved: {name}: {each.result.reason}"]
    if each.file is None:
        return [f"not saved: {name}: the same case is saved already"]
    saved = "patch" if each.file.suffix == _PATCH else "saved"
    text = f"{case.violation.description} ({'; '.join(_evidence(each, case))})"
    return [
        f"{saved} {shown_path(each.file, config)}",
        wrapped(text, width, first="    ", others="    "),
    ]


def _seen(each: InvestigatedSignature) -> str:
    """Return in words what was noted in how many flights that can be flown without NPCs."""
    flights = counted(each.seen, "flight")
    return f"{each.result.finding}, noted in {flights} with people, dogs or birds"


def _evidence(each: InvestigatedSignature, case: Case) -> list[str]:
    """Return in words how robust and preventable a case is, and how many flights it took."""
    if not each.result.flights:
        return [case.without_flights]
    return [
        *([case.robustness] if case.robustness else []),
        *([case.prevention.text] if case.prevention.text else []),
        *([] if case.gates else [f"{case.reason.upper()}, gates nothing"]),
        *([f"flown without NPCs because of {_seen(each)}"] if each.result.finding else []),
        case.shrinking,
        counted(each.result.flights, "flight"),
    ]


def _is_left(each: InvestigatedSignature) -> bool:
    """Return whether more flights would shrink a kind."""
    case = each.result.case
    return not each.result.flights or (case is not None and case.severity.is_guess)


def _not_shrunk(
    investigated: Sequence[InvestigatedSignature], shrink: int | None, width: int
) -> list[str]:
    """Return how many kinds are not shrunk, and how many flights it takes to shrink them.

    ``shrink`` is how many flights each had if somebody said it.
    """
    left = sum(_is_left(each) for each in investigated)
    if not left:
        return []
    if shrink is None:
        why = (
            f"By default shrinking has no more flights than the search. --garl-shrink={SHRINK} "
            f"gives each {SHRINK} (at most {SHRINK * len(investigated)} flights)"
        )
    else:
        why = f"Each had at most {shrink} flights (--garl-shrink={shrink}); more shrink further"
    text = (
        f"Not shrunk: {left} of {counted(len(investigated), 'cause')}. {why}; "
        "`garl cases shrink FILE` shrinks a saved case."
    )
    return [wrapped(text, width)]
