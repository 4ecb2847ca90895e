"""The ``garl`` command: one module per subcommand."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import click

from pytest_garl import cpu_dispatch, engine
from pytest_garl.cli.examples import add_examples
from pytest_garl.errors import GarlError, check_platform

COMMANDS = {
    "baseline": "baseline",
    "cases": "cases",
    "check": "check",
    "client": "client",
    "diff": "baseline",
    "domain": "domain",
    "export": "export",
    "film": "film",
    "init": "init",
    "report": "report",
    "risk": "risk",
    "schema": "schema",
    "train": "train",
}
"""The subcommands, and the module of each, without ``_command``."""
_FIRST = ("init", "check", "report", "cases", "film", "diff")
"""The subcommands that most people need, in the order in which they need them."""
_FLIES = "check"
"""The subcommand that flies in its own process."""
_ENGINE = {"baseline", "cases", "check", "diff", "export", "film", "train"}
"""The subcommands for which it matters which physics engine flies."""
_RESTARTED = "_PYTEST_GARL_RESTARTED"


class Pinned(click.Command):
    """A command that shows the project's errors without traceback, and flies as a worker does.

    Its code loads NumPy.  Before that, the environment must name the CPU instructions that NumPy
    may use.
    """

    def main(self, args: Any = None, *rest: Any, **more: Any) -> Any:
        """Start again if that lets flights be right or faster, then run."""
        # The C library reads its part of the environment when a process starts.
        is_slow = _FLIES in sys.argv[1:2] and not cpu_dispatch.was_started_for_flights()
        if args is None and (not cpu_dispatch.pin() or is_slow) and _RESTARTED not in os.environ:
            # NumPy may have been loaded while the interpreter started.
            os.environ[_RESTARTED] = "1"
            os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
        return super().main(args, *rest, **more)

    def invoke(self, ctx: click.Context) -> object:
        """Run, and show an error of the project in one line."""
        try:
            check_platform()
            with _clean_exit_on_sigterm():
                return super().invoke(ctx)
        except GarlError as error:
            raise click.ClickException(str(error)) from error


class _Group(Pinned, click.Group):
    """Loads a subcommand only when it is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        cpu_dispatch.pin()
        module = importlib.import_module(f"pytest_garl.cli.{COMMANDS[cmd_name]}_command")
        found: click.Command = getattr(module, cmd_name)
        add_examples(found, cmd_name)
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands that most people need before the others."""
        others = [name for name in self.list_commands(ctx) if name not in _FIRST]
        for heading, names in (("Commands", _FIRST), ("More commands", others)):
            lines = {name: self.get_command(ctx, name) for name in names}
            with formatter.section(heading):
                formatter.write_dl(
                    [(name, each.get_short_help_str(100)) for name, each in lines.items() if each]
                )


@contextlib.contextmanager
def _clean_exit_on_sigterm() -> Iterator[None]:
    """Let SIGTERM, the signal of build servers, end workers and remove temporary folders."""
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
@click.pass_context
def main(context: click.Context) -> None:
    """Prepare a search and manage its results.

    pytest runs the search itself: `pytest --garl-budget=40`. Run this command in the same
    folder. `garl COMMAND --help` explains a command.
    """
    if context.invoked_subcommand in _ENGINE:
        from pytest_garl.cli.pytest_settings import find_settings

        choice = str(find_settings(Path.cwd()).values.get("garl_engine") or "")
        if choice:
            engine.prefer(choice)
