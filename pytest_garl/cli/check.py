"""``garl check``: fly a landing system before a search does, and name its faults."""

from __future__ import annotations

import faulthandler
import sys
from pathlib import Path

import click

from pytest_garl.errors import LandingSystemError

LIMIT_S = 1800.0
"""The command ends after this wall time in any case, with a traceback."""


@click.command()
@click.argument("system", metavar="MODULE:CLASS")
@click.option(
    "--map",
    "maps",
    multiple=True,
    default=("lawn",),
    show_default=True,
    help="Map to fly on; may be given several times.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="End each flight after this simulated time.  [default: when it landed, or 120]",
)
@click.option(
    "--nondeterministic",
    is_flag=True,
    help="Only warn if equal flights differ (as deterministic=False in the marker).",
)
def check(
    system: str, maps: tuple[str, ...], seconds: float | None, nondeterministic: bool
) -> None:
    """Fly a landing system without moving objects and name its faults.

    It flies two scenarios, and the first one again. Run it where you run pytest. The exit status is
    1 if there is a fault that a search would meet in every flight. Warnings name other problems of
    a search.
    """
    from pytest_garl.testing import check_landing_system

    # Nothing else interrupts a call that hangs in C code and holds the interpreter.
    faulthandler.dump_traceback_later(LIMIT_S, exit=True, file=sys.__stderr__ or 2)
    try:
        found = imported_system(system)
        for name in maps:
            result = check_landing_system(
                found, map=name, seconds=seconds, deterministic=not nondeterministic
            )
            click.echo(result)
    finally:
        faulthandler.cancel_dump_traceback_later()


def imported_system(name: str) -> type:
    """Return a landing system's class, imported as from the current folder."""
    if str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    from pytest_garl.execution.reference import system_named

    try:
        system: type = system_named(name)
    except LandingSystemError as error:
        raise LandingSystemError(
            f"{name!r}: cannot be imported as a landing system ({error}); expected "
            "MODULE:CLASS, as my_landing:MyLandingSystem, found from the current folder"
        ) from error
    return system
