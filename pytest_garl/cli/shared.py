"""What several commands share: the option that names the folder of cases, and how they print."""

from __future__ import annotations

from pathlib import Path

import click

from pytest_garl.cli.pytest_settings import find_settings
from pytest_garl.files.run_files import CASES_FOLDER, RUN_FOLDER, SEARCH_LEDGER
from pytest_garl.messages import printable

LEDGER = Path(RUN_FOLDER, SEARCH_LEDGER)


def folder_of_cases() -> Path:
    """Return the folder to which pytest saves cases if it is called here."""
    return Path(str(find_settings(Path.cwd()).values.get("garl_cases") or CASES_FOLDER))


FOLDER = click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=folder_of_cases,
    show_default=f"ini key garl_cases, or {CASES_FOLDER}",
    help="Folder of the cases.",
)


def say(text: str, *, err: bool = False) -> None:
    """Print a text that may hold names and content of files, without control characters."""
    click.echo(printable(text), err=err)
