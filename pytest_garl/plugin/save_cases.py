"""After the items: confirm, shrink and save what the search found, and say so."""

from __future__ import annotations

import functools
import os
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.options import SHRINK
from pytest_garl.plugin.progress import show_progress
from pytest_garl.plugin.run import Run
from pytest_garl.plugin.suggested_commands import shown
from pytest_garl.plugin.terminal_text import begin_line, counted, duration, width_of, wrapped
from pytest_garl.plugin.user_assertions import collect_assertion
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_request import CaseRequest
from pytest_garl.regressions.flight_shares import divide_flights
from pytest_garl.regressions.follow_up import (
    InvestigatedSignature,
    ShrinkBudget,
    case_requests,
    follow_up,
)
from pytest_garl.regressions.forecast import remaining_work

PILOT = {
    "live": "the reference pilot violates nothing",
    "recorded": "the reference pilot violates nothing unless it is pursued as well",
    "no": "UNAVOIDABLE, gates nothing",
}


def save_cases(run: Run, session: pytest.Session) -> None:
    """Pursue new signatures; what comes of it is told in the summary."""
    options, config = run.options, session.config
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    try:
        for nodeid, signature in sorted(run.reported_failures.items()):
            target, user_assertion = collect_assertion(session, nodeid)
            run.user_assertions[target.search, signature] = user_assertion
        shrinking = ShrinkBudget(each=options.shrink, capped=options.shrink_capped)
        requests = case_requests(
            run.ledger, options.corpus, shrinking, run.user_assertions, run.finding_tests
        )
        if requests:
            most = sum(each.budget for each in divide_flights(requests))
            run.remaining = remaining_work(requests, _flight_s(run, requests), options.workers or 1)
            begin_line(reporter)
            reporter.write_line(
                "garl: confirming and shrinking "
                f"{counted(len(requests), 'new kind')} of violation, "
                f"at most {counted(most, 'flight')}, about {duration(run.remaining.seconds)}"
            )
        with show_progress(run, config):
            run.investigated = follow_up(run.ledger, run.pool, requests, _saver(run), run.on_wait)
    except KeyboardInterrupt:
        begin_line(reporter)
        reporter.write_line(
            "garl: interrupted before everything was saved; the same command with --garl-resume "
            "goes on"
        )
    except GarlError as error:
        begin_line(reporter)
        reporter.write_line(f"garl: {error}", red=True)
        run.save_problem = str(error)


def _saver(run: Run) -> Callable[[Case], Path | None]:
    """Return how to save a case: as a file, or as a patch if the tree must not change."""
    options = run.options
    if not os.environ.get("CI"):
        return options.corpus.save
    # A build server deletes the tree after the run; a patch can be kept.
    patches = options.folder / "patches"
    return functools.partial(options.corpus.save_patch, patches=patches, root=options.root)


def _flight_s(run: Run, requests: Sequence[CaseRequest]) -> dict[str, float]:
    """Return how long a flight of each signature took in the search."""
    known = run.ledger.queries.seconds_by_kind()
    any_s = run.ledger.queries.seconds_per_flight() or run.flight_s
    return {each.name: known.get((each.search, each.signature)) or any_s for each in requests}


def saved_lines(pursued: tuple[InvestigatedSignature, ...], config: pytest.Config) -> list[str]:
    """Return the summary's lines about saved cases."""
    lines: list[str] = []
    patches = []
    width = width_of(config)
    for each in pursued:
        case = each.result.case
        name = f"{each.system.split(':')[-1]} on {each.map}: {each.result.signature}"
        if case is None:
            lines.append(f"not saved: {name}: {each.result.reason}")
            continue
        if each.file is None:
            lines.append(f"not saved: {name}: the same case is saved already")
            continue
        file = shown(each.file, config)
        if each.file.suffix == ".patch":
            patches.append(shlex.quote(file))
        lines.append(f"{'patch' if each.file.suffix == '.patch' else 'saved'} {file}")
        text = f"{case.violation.description} ({'; '.join(_facts(each, case))})"
        lines.append(wrapped(text, width, first="    ", others="    "))
    if patches:
        lines.append("Nothing in the tree was changed (CI is set). To keep the cases:")
        lines.append(" \\\n        ".join(["    git apply", *patches]))
    if any(each.file for each in pursued) and not patches:
        text = (
            "New cases fail until they are fixed, committed, or accepted with `garl cases accept "
            "FILE`. `garl cases show FILE` tells more of one."
        )
        lines.append(wrapped(text, width))
    return [*lines, *_unreached(pursued, width)]


def _facts(each: InvestigatedSignature, case: Case) -> list[str]:
    """Return in words why a case may be believed, and what it cost."""
    evidence = case.evidence
    if not each.result.flights:
        return ["as the search found it, not shrunk"]
    asked = [
        f"{evidence.neighbours_failed} of {evidence.neighbours} neighbours fail too",
        *(["EDGE, gates nothing"] if case.edge else []),
        PILOT[case.avoidable],
    ]
    return [
        *(asked if evidence.neighbours else []),
        f"shrinking removed {evidence.removed}",
        counted(each.result.flights, "flight"),
    ]


def _unreached(pursued: tuple[InvestigatedSignature, ...], width: int) -> list[str]:
    """Say which kinds are not shrunk, and how many flights would reach them."""
    left = sum(not each.result.flights for each in pursued)
    if not left:
        return []
    text = (
        f"{counted(left, 'kind')} of violation not shrunk: shrinking has no more flights than the "
        f"search. --garl-shrink={SHRINK} has no such limit and reaches all of them (at most "
        f"{SHRINK * len(pursued)} flights); `garl cases shrink FILE` shrinks a saved one."
    )
    return [wrapped(text, width)]
