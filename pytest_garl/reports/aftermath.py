"""After the items: confirm, shrink and save what the search found, and say so."""

from __future__ import annotations

import os
import textwrap
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.own import asks_of
from pytest_garl.regressions.follow_up import Place, Pursued, follow_up, inquiries
from pytest_garl.reports.progress import live
from pytest_garl.run import Run

PILOT = {
    "live": "the reference pilot violates nothing",
    "recorded": "the reference pilot violates nothing unless it is pursued as well",
    "no": "UNAVOIDABLE, gates nothing",
}


def pursue(run: Run, session: pytest.Session) -> None:
    """Pursue new signatures; what comes of it is told in the summary."""
    options, config = run.options, session.config
    place = Place(
        root=options.root,
        cases=options.cases,
        # A build server's tree is thrown away: what is to stay goes out as a patch.
        patches=options.folder / "patches" if os.environ.get("CI") else None,
        map_folders=options.map_folders,
    )
    reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
    try:
        for nodeid, signature in sorted(run.told.items()):
            target, asks = asks_of(session, nodeid)
            run.own[target.search, signature] = asks
        wanted = inquiries(run.ledger, place, options.shrink, run.own, run.found_by)
        reached = [each for each in wanted if each.budget]
        if reached:
            reporter.ensure_newline()
            reporter.write_line(
                f"garl: confirming and shrinking {len(reached)} new kinds of violation, at most "
                f"{sum(each.budget for each in reached)} flights"
            )
        with live(run, config):
            run.pursued = follow_up(run.ledger, run.pool, place, wanted, run.tick)
    except KeyboardInterrupt:
        reporter.ensure_newline()
        reporter.write_line(
            "garl: interrupted before everything was saved; the same command with --garl-resume "
            "goes on"
        )
    except GarlError as error:
        reporter.ensure_newline()
        reporter.write_line(f"garl: {error}", red=True)
        run.troubled = True


def told(pursued: tuple[Pursued, ...], root: Path) -> list[str]:
    """Return the summary's lines about saved cases."""
    lines: list[str] = []
    patches = False
    for each in pursued:
        case = each.finding.case
        name = f"{each.system.split(':')[-1]} on {each.map}: {each.finding.signature}"
        if case is None:
            lines.append(f"not saved: {name}: {each.finding.reason}")
            continue
        if each.file is None:
            lines.append(f"not saved: {name}: the same case is saved already")
            continue
        patches |= each.file.suffix == ".patch"
        shown = each.file.relative_to(root) if each.file.is_relative_to(root) else each.file
        lines.append(f"{'patch' if each.file.suffix == '.patch' else 'saved'} {shown}")
        evidence = case.evidence
        facts = [
            f"{evidence.neighbours_failed} of {evidence.neighbours} neighbours fail too",
            PILOT[case.avoidable],
            f"shrinking removed {evidence.removed}",
            f"{each.finding.flights} flights",
        ]
        text = f"{case.violation.story} ({'; '.join(facts)})"
        lines += textwrap.wrap(text, 96, initial_indent="    ", subsequent_indent="    ")
    if patches:
        lines.append("Nothing in the tree was changed (CI is set). To keep the cases:")
        lines.append("    git apply .garl/patches/*.patch")
    return lines
