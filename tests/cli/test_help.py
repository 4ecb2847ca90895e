from __future__ import annotations

import re
import shlex
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from pytest_garl.cli import COMMANDS, main
from pytest_garl.cli.examples import EXAMPLES
from pytest_garl.plugin.arguments import OPTIONS

WIDEST = 55


def commands(group: click.Command = main, words: str = "") -> Iterator[tuple[str, click.Command]]:
    if not isinstance(group, click.Group):
        return
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        yield f"{words}{name}", command
        yield from commands(command, f"{words}{name} ")


ALL = dict(commands())


def test_every_command_has_two_examples_and_a_short_line() -> None:
    assert set(EXAMPLES) == set(ALL)
    for words, command in ALL.items():
        line = command.get_short_help_str(200)
        assert line.endswith("."), words
        assert len(line) <= WIDEST, words
        shown = CliRunner().invoke(main, [*words.split(), "--help"]).output
        assert len(EXAMPLES[words]) == 2
        assert all(f"\n    {example}\n" in f"{shown}\n" for example in EXAMPLES[words])


def test_help_lists_every_command_once_and_the_first_six_first() -> None:
    shown = CliRunner().invoke(main, ["--help"]).output
    first, more = shown.split("Commands:\n")[1].split("More commands:\n")
    names = [re.findall(r"^  (\w+)", part, re.MULTILINE) for part in (first, more)]
    assert len(names[0]) == 6
    assert sorted(names[0] + names[1]) == sorted(COMMANDS)


@pytest.mark.parametrize("example", sorted({each for both in EXAMPLES.values() for each in both}))
def test_an_example_names_commands_and_options_that_exist(example: str) -> None:
    words = shlex.split(example.split(" | ")[0].split(" >")[0])
    given = {word.split("=")[0] for word in words if word.startswith("--")}
    if words[0] == "pytest":
        assert given <= {f"--garl-{option.name}" for option in OPTIONS}
        return
    assert words[0] == "garl"
    plain = [word for word in words[1:] if not word.startswith("--")]
    path = " ".join(plain[:2]) if " ".join(plain[:2]) in ALL else plain[0]
    params = [*ALL[path].params, *ALL[path.split()[0]].params]
    assert given <= {flag for param in params for flag in param.opts}
