"""``garl report``: report the findings of a run, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from pytest_garl.cases.corpus import Corpus
from pytest_garl.cli.shared import FOLDER
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.messages import printable
from pytest_garl.reports.html import MOST_FILMS
from pytest_garl.reports.run_report import run_report_as_json
from pytest_garl.reports.shares_text import PAPER_DEFINITION, in_control_text


@click.command()
@click.argument(
    "ledger",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path(".garl/ledger.sqlite"),
)
@click.argument("later", type=click.Path(path_type=Path, dir_okay=False), required=False)
@click.option(
    "--json", "as_json", is_flag=True, help="Write JSON; docs/report.md explains the keys."
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Write the report as pages into this folder; with --json write the JSON to this file.",
)
@click.option(
    "--films",
    type=click.IntRange(min=0),
    default=MOST_FILMS,
    show_default=True,
    help="Kinds of violation that have a film in the pages (extra: video).",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    help="Number of processes that draw the pages (default: one per core).",
)
@FOLDER
def report(
    ledger: Path,
    later: Path | None,
    as_json: bool,
    out: Path | None,
    films: int,
    workers: int | None,
    folder: Path,
) -> None:
    """Report the findings of the run in LEDGER (default .garl/ledger.sqlite).

    Without options it prints a short form; --out=DIR writes pages for people, which begin with
    DIR/index.html. Use it while the run goes on, or after a run was killed.

    With the ledger of a LATER run it shows the two side by side: which kinds of violation came and
    went, landed and gave up. To compare two versions of a landing system in the same scenarios, use
    `garl diff`.
    """
    corpus = Corpus(folder, (Path.cwd() / "scenarios" / "maps",))
    if later is not None:
        _compare(ledger, later, as_json, out, corpus)
        return
    if out is not None and not as_json:
        _write_pages(ledger, out, corpus, films, workers)
        return
    found = run_report_as_json(ledger, corpus)
    _tell(json.dumps(found, indent=2) + "\n" if as_json else _text(found), out)


def _compare(ledger: Path, later: Path, as_json: bool, out: Path | None, corpus: Corpus) -> None:
    from pytest_garl.reports.run_comparison import compare_runs, comparison_text

    found = compare_runs(run_report_as_json(ledger, corpus), run_report_as_json(later, corpus))
    if as_json:
        _tell(json.dumps(found.to_json(), indent=2) + "\n", out)
    elif out is None:
        click.echo(comparison_text(found), nl=False)
    else:
        from pytest_garl.reports.html.report import write_comparison

        click.echo(printable(str(write_comparison(found, out))))


def _tell(text: str, out: Path | None) -> None:
    if out is None:
        click.echo(text, nl=False)
    else:
        write_text_atomically(out, text)


def _write_pages(ledger: Path, out: Path, corpus: Corpus, films: int, workers: int | None) -> None:
    from pytest_garl.reports.html.report import write_html_report

    written = write_html_report(ledger, out, corpus, films=films, workers=workers)
    for note in written.notes:
        click.echo(printable(f"garl: {note}"), err=True)
    click.echo(printable(f"{written.index}: {written.pages} pages, {written.films} films"))


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def _text(found: dict[str, Any]) -> str:
    lines = []
    for search in found["searches"]:
        name = search["system"].split(":")[-1]
        late = search["not_landed"]
        lines.append(
            f"{name} on {search['map']}: {search['flown']} of {search['wanted']} flown, "
            f"{search['landed']} landed, {search['violating']} violate "
            f"({search['violating_by_the_paper']} {PAPER_DEFINITION}), "
            f"gave up: {_counts(search['gave_up'])}"
            f"{f'; ran out of time: {_counts(late)}' if any(late.values()) else ''}"
        )
        control = search["control"]
        if control:
            lines.append(f"  {control['text']}")
        for kind in search["signatures"]:
            severity = kind["severity"] or {}
            unusual = severity.get("text", "")
            least = "at the least" if severity.get("took") else "unusual in the mildest of them"
            seen = in_control_text(
                kind["in_control"], control["random"]["flights"] if control else 0
            )
            title, *ending = [*filter(None, (kind["title"], kind["headline"]))] or [""]
            lines.append(f"  {kind['count']:4d}  {kind['signature']}: {title}")
            lines += [f"        {text}" for text in ending]
            lines += [f"        {least}: {unusual}"] if unusual else []
            lines += [f"        {text}" for text in (seen, kind["repeat"]) if text]
    return "\n".join([*lines, ""]) if lines else "no flights yet\n"
