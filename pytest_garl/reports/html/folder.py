"""The folder of a report: written whole or not at all, and only in place of another report."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from pytest_garl.errors import SavingError
from pytest_garl.messages import shown
from pytest_garl.reports.html.naming import GENERATOR, INDEX, KINDS, STILLS

_HEAD_BYTES = 4096
"""The generator stands in the first lines of a page."""
_TRIAL_BYTES = 100_000
"""The size of a small page."""


def check_target(folder: Path) -> None:
    """Raise SavingError unless a report may be written there: nothing, or a report of ours."""
    where = Path(os.path.realpath(folder))
    try:
        if where.exists() and not where.is_dir():
            raise SavingError(
                f"{folder}: found a file, expected a folder for the report; name another one"
            )
        held = sorted(each.name for each in where.iterdir()) if where.is_dir() else []
        foreign = [name for name in held if name not in (INDEX, KINDS, STILLS)]
        if held and (foreign or not _is_report(where)):
            what = shown(foreign[0]) if foreign else f"an {INDEX} that is not of {GENERATOR}"
            raise SavingError(
                f"{folder}: found a folder with {what}, expected an empty folder, a report of "
                "pytest-garl, or nothing; name another folder, or empty this one"
            )
    except OSError as error:
        raise SavingError(_unwritable(folder, error)) from error
    parent = next(each for each in where.parents if each.exists())
    try:
        # Rights alone do not tell: a disk may be read-only or full.
        with tempfile.TemporaryDirectory(prefix=f".{where.name}.", dir=parent) as trial:
            Path(trial, INDEX).write_bytes(bytes(_TRIAL_BYTES))
    except OSError as error:
        raise SavingError(_unwritable(folder, error)) from error


def _is_report(folder: Path) -> bool:
    index = folder / INDEX
    if not index.is_file():
        return False
    with index.open("rb") as file:
        return f'content="{GENERATOR}"'.encode() in file.read(_HEAD_BYTES)


@contextlib.contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Yield a folder to write into, which takes the place of ``folder`` if all goes well.

    Raises SavingError if ``folder`` cannot be written, or holds anything but a report.
    """
    check_target(folder)
    where = Path(os.path.realpath(folder))
    incomplete = where.with_name(f".{where.name}.{os.getpid()}")
    before = where.with_name(f".{where.name}.{os.getpid()}.before")
    try:
        try:
            where.parent.mkdir(parents=True, exist_ok=True)
            incomplete.mkdir()
            for name in (KINDS, STILLS):
                (incomplete / name).mkdir()
            yield incomplete
            if where.is_dir():
                where.replace(before)
            try:
                incomplete.replace(where)
            except OSError:
                if before.is_dir():
                    before.replace(where)
                raise
        except OSError as error:
            raise SavingError(_unwritable(folder, error)) from error
    finally:
        for each in (incomplete, before):
            shutil.rmtree(each, ignore_errors=True)


def _unwritable(folder: Path, error: OSError) -> str:
    return (
        f"{folder}: the report cannot be written ({error.strerror or error}): name a folder that "
        "may be written, with some megabytes of space"
    )
