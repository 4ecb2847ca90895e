"""``garl report``: report the findings of a run, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from pytest_garl.cases.corpus import Corpus
from pytest_garl.cli.shared import FOLDER, LEDGER
from pytest_garl.files.atomic import write_text_atomically
from pytest_garl.messages import printable
from pytest_garl.reports.html import MOST_FILMS
from pytest_garl.reports.run_json import run_as_json
from pytest_garl.reports.run_reading import read_run
from pytest_garl.reports.run_text import run_text


@click.command()
@click.argument(
    "ledger",
    type=click.Path(path_type=Path, dir_okay=False),
    default=LEDGER,
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
    """Report what a run found, as text, pages or JSON.

    The run is that of LEDGER (default .garl/ledger.sqlite). Without options it prints a short form;
    --out=DIR writes pages for people, which begin with DIR/index.html. Use it while the run goes
    on, or after a run was killed.

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
    run = read_run(ledger, corpus)
    _tell(json.dumps(run_as_json(run), indent=2) + "\n" if as_json else run_text(run), out)


def _compare(ledger: Path, later: Path, as_json: bool, out: Path | None, corpus: Corpus) -> None:
    from pytest_garl.reports.run_comparison import compare_runs, comparison_text

    found = compare_runs(read_run(ledger, corpus), read_run(later, corpus))
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
    from pytest_garl.reports.html.folder import check_target
    from pytest_garl.reports.html.report import write_html_report

    check_target(out)
    run = read_run(ledger, corpus, checked=True)
    written = write_html_report(run, out, films=films, workers=workers)
    for note in written.notes:
        click.echo(printable(f"garl: {note}"), err=True)
    click.echo(printable(f"{written.index}: {written.pages} pages, {written.films} films"))
