"""``python -m lab.experiment``: fly systems × maps × methods × seeds, and report the results."""

from __future__ import annotations

import os
from pathlib import Path

import click

from pytest_garl.cli import Pinned

INTERRUPTED = 130
"""Exit status after Ctrl-C as in shells: 128 plus the signal's number."""
_FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command(
    cls=Pinned,
    epilog="Example: "
    "python -m lab.experiment docs/results/experiments/smoke.toml --out=.garl/smoke",
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
        folders = CampaignFolders(rows=rows_file, runs=folder, root=Path.cwd())
        fly_experiment(spec, folders, workers, click.echo)
    except KeyboardInterrupt:
        click.echo("interrupted; finished flights are kept, the same command continues", err=True)
        raise SystemExit(INTERRUPTED) from None
    click.echo(f"all {len(spec.runs)} runs are in {rows_file}; add --report to write the report")


if __name__ == "__main__":
    experiment()
