"""The ``garl`` command: one module per subcommand."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import sys
from collections.abc import Iterator
from typing import Any, NoReturn

import click

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError

COMMANDS = {
    "baseline": "baseline",
    "cases": "cases",
    "check": "check",
    "diff": "baseline",
    "experiment": "experiment",
    "report": "report",
    "train": "train",
}
"""The subcommands, and the module of each."""
_AGAIN = "_PYTEST_GARL_STARTED_AGAIN"


class _Group(click.Group):
    """Loads a subcommand when it is asked for, and shows the project's errors without traceback.

    What the subcommands import loads NumPy, which must not happen before it is told by which
    instructions to compute.
    """

    def main(self, args: Any = None, *rest: Any, **more: Any) -> Any:
        if args is None and not cpu_dispatch.pin() and _AGAIN not in os.environ:
            # Something loaded NumPy as the interpreter started; the environment is right now.
            os.environ[_AGAIN] = "1"
            os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
        return super().main(args, *rest, **more)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        cpu_dispatch.pin()
        module = importlib.import_module(f"pytest_garl.cli.{COMMANDS[cmd_name]}")
        found: click.Command = getattr(module, cmd_name)
        return found

    def invoke(self, ctx: click.Context) -> object:
        try:
            with _ended_in_order():
                return super().invoke(ctx)
        except GarlError as error:
            raise click.ClickException(str(error)) from error


@contextlib.contextmanager
def _ended_in_order() -> Iterator[None]:
    """Have SIGTERM, by which build servers cancel, end children and remove temporary folders."""
    before = signal.signal(signal.SIGTERM, _exit)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _exit(number: int, frame: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="pytest-garl", prog_name="garl")
def main() -> None:
    """Prepare a search and manage its results.

    pytest runs the search itself: `pytest --garl-budget=40`. Run this command in the same
    folder. `garl COMMAND --help` explains a command.
    """
