"""``python -m lab.experiment``: fly systems × maps × methods × seeds, and report the results."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from pytest_garl.cli import Pinned

if TYPE_CHECKING:
    from lab.experiment.results import ResultRow
    from lab.experiment.spec import ExperimentRun
    from pytest_garl.execution.ledger_queries import SearchProgress

INTERRUPTED = 130
"""Exit status after Ctrl-C as in shells: 128 plus the signal's number."""
_FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command(
    cls=Pinned,
    epilog="Example: python -m lab.experiment docs/experiments/smoke.toml --out=.garl/smoke",
)
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option(
    "--report", is_flag=True, help="Fly nothing: write the report from the existing rows."
)
@click.option(
    "--out",
    type=_FOLDER,
    help="Folder for rows and report, instead of the place that FILE names.",
)
@click.option(
    "--folder",
    type=_FOLDER,
    default=Path(".garl/experiments"),
    show_default=True,
    help="Folder of the runs' ledgers; an interrupted run continues from there.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=lambda: os.cpu_count() or 1,
    show_default="one per CPU core",
    help="Number of worker processes.",
)
def experiment(file: Path, report: bool, out: Path | None, folder: Path, workers: int) -> None:
    """Fly the searches of FILE that its rows lack.

    FILE is a TOML file; its rows are in a CSV file of the same name. Run it where you run pytest.
    Each finished run is added at once. If you interrupt it, the same command continues.
    """
    from lab.experiment.campaign import CampaignFolders, fly_experiment
    from lab.experiment.report import write_report
    from lab.experiment.results import read_rows
    from lab.experiment.spec import read_experiment

    spec = read_experiment(file)
    rows_file = out / spec.rows.name if out else spec.rows
    if report:
        path = out / spec.report.name if out else spec.report
        click.echo(f"wrote {write_report(spec, read_rows(rows_file), rows_file.name, path)}")
        return
    try:
        with _ProgressDisplay() as display:
            folders = CampaignFolders(rows=rows_file, runs=folder, root=Path.cwd())
            fly_experiment(spec, folders, workers, display)
    except KeyboardInterrupt:
        click.echo("interrupted; finished flights are kept, the same command continues", err=True)
        raise SystemExit(INTERRUPTED) from None
    click.echo(f"all {len(spec.runs)} runs are in {rows_file}; add --report to write the report")


class _ProgressDisplay:
    """Prints a line per run, and shows a progress bar of the current run on a terminal."""

    def __init__(self) -> None:
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=Console(highlight=False),
            # No thread for refreshing, because this process is forked.
            auto_refresh=False,
            transient=True,
        )
        self._print = self._bar.console.print
        self._task = self._bar.add_task("", total=None, visible=False)

    def __enter__(self) -> _ProgressDisplay:
        if self._bar.console.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.console.is_terminal:
            self._bar.stop()

    def on_run_begin(self, run: ExperimentRun, number: int, total: int) -> None:
        self._print(Text(f"run {number} of {total}: {run.title}"))
        wanted = run.budget * len(run.maps)
        self._bar.reset(self._task, total=wanted, description="flying", visible=True)

    def on_flights(self, searches: Sequence[SearchProgress]) -> None:
        self._bar.update(self._task, completed=sum(each.flown for each in searches))
        self._bar.refresh()

    def on_run_end(self, rows: Sequence[ResultRow]) -> None:
        for row in rows:
            top10 = row.top10 or "not reached"
            self._print(
                Text(
                    f"    {row.map}: {row.landed} of {row.budget} landed, {row.violations} "
                    f"violate, {len(row.signatures)} kinds, Top-10 {top10}"
                )
            )


if __name__ == "__main__":
    experiment()
