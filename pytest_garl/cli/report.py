"""``garl report``: report the findings of a run, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from pytest_garl.cli.cases import FOLDER
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.regressions.corpus import Corpus
from pytest_garl.reports.run_report import run_report_as_json
from pytest_garl.reports.shares_text import in_control_text


@click.command()
@click.argument(
    "ledger",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path(".garl/ledger.sqlite"),
)
@click.option(
    "--json", "as_json", is_flag=True, help="Write JSON; docs/report.md explains the keys."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write to this file instead of to standard output.",
)
@FOLDER
def report(ledger: Path, as_json: bool, out: Path | None, folder: Path) -> None:
    """Report the findings of the run in LEDGER (default .garl/ledger.sqlite).

    Use it while the run goes on, or after a run was killed.
    """
    found = run_report_as_json(ledger, Corpus(folder, (Path.cwd() / "scenarios" / "maps",)))
    text = json.dumps(found, indent=2) + "\n" if as_json else _text(found)
    if out is None:
        click.echo(text, nl=False)
    else:
        write_text_atomically(out, text)


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def _text(found: dict[str, Any]) -> str:
    lines = []
    for search in found["searches"]:
        name = search["system"].split(":")[-1]
        lines.append(
            f"{name} on {search['map']}: {search['flown']} of {search['wanted']} flown, "
            f"{search['landed']} landed, {search['violating']} violate "
            f"({search['violating_by_the_paper']} by the paper's definition, no landing counted), "
            f"gave up: {_counts(search['gave_up'])}"
        )
        control = search["control"]
        if control:
            lines.append(f"  {control['text']}")
        for kind in search["signatures"]:
            took = (kind["severity"] or {}).get("text", "")
            seen = in_control_text(
                kind["in_control"], control["random"]["flights"] if control else 0
            )
            lines.append(f"  {kind['count']:4d}  {kind['signature']}: {kind['headline']}")
            lines += [f"        at the least: {took}"] if took else []
            lines += [f"        {text}" for text in (seen, kind["repeat"]) if text]
    return "\n".join([*lines, ""]) if lines else "no flights yet\n"
