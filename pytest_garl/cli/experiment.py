"""``garl experiment``: fly systems × maps × methods × seeds, and report the results."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

if TYPE_CHECKING:
    from pytest_garl.execution.ledger_queries import SearchProgress
    from pytest_garl.experiments.results import Row
    from pytest_garl.experiments.spec import Run

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells have it: 128 and the signal's number."""
PILOTS = "the reference pilot flies what violated"
_FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command(epilog="Example: garl experiment docs/experiments/smoke.toml --out=.garl/smoke")
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option(
    "--report", is_flag=True, help="Fly nothing: write the report from the existing rows."
)
@click.option(
    "--out",
    type=_FOLDER,
    help="Folder for rows, report and pictures, instead of where FILE says.",
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

    FILE is a TOML file; the rows are a CSV file of its name beside it. Run it where you run pytest.
    Each finished run is added at once. If you interrupt it, the same command continues.
    """
    from pytest_garl.experiments import results as rows
    from pytest_garl.experiments.campaign import Place, fly
    from pytest_garl.experiments.report import write
    from pytest_garl.experiments.spec import read

    asked = read(file)
    found = out / asked.rows.name if out else asked.rows
    if report:
        path = out / asked.report.name if out else asked.report
        click.echo(f"wrote {write(asked, rows.read(found), found.name, path)}")
        return
    try:
        with _Shown() as shown:
            fly(asked, Place(rows=found, runs=folder, root=Path.cwd()), workers, shown)
    except KeyboardInterrupt:
        click.echo("interrupted; what is flown is kept, the same command goes on", err=True)
        raise SystemExit(INTERRUPTED) from None
    click.echo(f"all {len(asked.runs)} runs are in {found}; the report: the same with --report")


class _Shown:
    """A line per run, and on a terminal a bar that shows how far the one under way is."""

    def __init__(self) -> None:
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=Console(highlight=False),
            # The bar is drawn when something is told: a thread beside would be forked with.
            auto_refresh=False,
            transient=True,
        )
        self._tell = self._bar.console.print
        self._task = self._bar.add_task("", total=None, visible=False)

    def __enter__(self) -> _Shown:
        if self._bar.console.is_terminal:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar.console.is_terminal:
            self._bar.stop()

    def begins(self, run: Run, number: int, total: int) -> None:
        self._tell(Text(f"run {number} of {total}: {run.title}"))
        wanted = run.budget * len(run.maps)
        self._bar.reset(self._task, total=wanted, description="flying", visible=True)

    def flies(self, searches: Sequence[SearchProgress]) -> None:
        self._bar.update(self._task, completed=sum(each.flown for each in searches))
        self._bar.refresh()

    def pilots(self) -> None:
        if self._bar.tasks[0].description != PILOTS:
            self._bar.update(self._task, description=PILOTS)
            self._bar.refresh()

    def ended(self, rows: Sequence[Row]) -> None:
        for row in rows:
            top10 = row.top10 or "not reached"
            self._tell(
                Text(
                    f"    {row.map}: {row.violations} of {row.budget} violate, "
                    f"{len(row.signatures)} signatures, Top-10 {top10}"
                )
            )
