"""The ``garl`` command: one module per subcommand."""

from __future__ import annotations

import click

from pytest_garl.cli.baseline import baseline, diff
from pytest_garl.cli.cases import cases
from pytest_garl.cli.experiment import experiment
from pytest_garl.cli.train import train
from pytest_garl.errors import GarlError


class _Group(click.Group):
    """Shows the project's errors as they are, without a traceback."""

    def invoke(self, ctx: click.Context) -> object:
        try:
            return super().invoke(ctx)
        except GarlError as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="pytest-garl", prog_name="garl")
def main() -> None:
    """Tools beside pytest --garl-budget=N.

    The search itself is pytest: run `pytest --garl-budget=40` where your landing tests are.
    This command prepares what a search uses, and looks after what it found.
    `garl COMMAND --help` explains a command.
    """


main.add_command(baseline)
main.add_command(cases)
main.add_command(diff)
main.add_command(experiment)
main.add_command(train)
