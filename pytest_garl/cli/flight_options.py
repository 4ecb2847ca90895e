"""The argument and the options by which commands name a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pytest_garl.cli.shared import FOLDER, LEDGER

_OPTIONS = (
    click.argument("flight", metavar="SLOT|CASE|FILE"),
    click.option(
        "--ledger",
        type=click.Path(path_type=Path, dir_okay=False),
        help=f"Ledger of the run.  [default: {LEDGER}]",
    ),
    click.option(
        "--scenario",
        type=click.Path(path_type=Path, exists=True, dir_okay=False),
        help="Scenario that was flown, or its case: for a flight's file that no ledger knows.",
    ),
    click.option(
        "--system",
        metavar="MODULE:CLASS",
        help="Landing system that flew it, for its camera: for a flight's file that no ledger "
        "knows.",
    ),
    FOLDER,
)


def flight_options(command: Any) -> Any:
    """Add the argument and the options of which a ``FlightName`` is made to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
