"""The commands that a report prints; they work in the folder where pytest was called."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from pytest_garl.messages import command, printable

if TYPE_CHECKING:
    from pytest_garl.plugin.items.target import Target

_FOLDERS = ("garl_dir", "garl_cases")


def repeat_command(config: pytest.Config, tests: Iterable[str], scenario: str) -> str:
    """Return the command that flies a scenario again in ``tests``, a node id or several files."""
    repeat = f"--garl-repeat={scenario}"
    return command("pytest", *tests, repeat, *_location_options(config))


def repeat_line(item: pytest.Item, target: Target) -> str:
    """Return the line of a failure with the command that repeats its scenario."""
    file, separator, name = item.nodeid.partition("::")
    path = os.path.relpath(item.config.rootpath / file, item.config.invocation_params.dir)
    test = f"{path}{separator}{name}"
    return f"Repeat: {repeat_command(item.config, [test], target.file or target.name)}"


def _location_options(config: pytest.Config) -> list[str]:
    """Return the options of the command line that set files and folders."""
    found = []
    for option, value in (("-c", config.option.inifilename), ("--rootdir", config.option.rootdir)):
        if value:
            found += [option, str(value)]
    for given in config.option.override_ini or ():
        if given.partition("=")[0].strip() in _FOLDERS:
            found += ["-o", given]
    return found


def shown_path(path: Path, config: pytest.Config) -> str:
    """Return a path as seen from where pytest was called."""
    here = config.invocation_params.dir
    found = path.relative_to(here) if path.is_relative_to(here) else path
    return printable(str(found), keep="")


def repeat_files_command(config: pytest.Config, files: Iterable[str], scenario: str) -> str:
    """Return the command that flies a scenario again in files, named as seen from the root."""
    return repeat_command(
        config, (shown_path(config.rootpath / file, config) for file in files), scenario
    )
