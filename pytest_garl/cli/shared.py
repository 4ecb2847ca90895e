"""What several commands share: the option that names the folder of cases, and how they print."""

from __future__ import annotations

from pathlib import Path

import click

from pytest_garl.messages import printable

DEFAULT_FOLDER = Path("scenarios/regressions")
LEDGER = Path(".garl/ledger.sqlite")
FOLDER = click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=DEFAULT_FOLDER,
    show_default=True,
    help="Folder of the cases (the ini key garl_cases).",
)


def say(text: str, *, err: bool = False) -> None:
    """Print a text that may hold names and content of files, without control characters."""
    click.echo(printable(text), err=err)
