"""Files of a bounded size, read whole: no device, no pipe, and nothing that fills the memory."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from pytest_garl.errors import GarlError, ScenarioError

MEGABYTE = 1_000_000
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def read_bytes(
    path: Path, limit: int = MEGABYTE, error: type[GarlError] = ScenarioError, hint: str = ""
) -> bytes:
    """Return what is in a regular file of at most ``limit`` bytes; raise ``error`` otherwise.

    ``hint`` says at the end of a message what file was expected.
    """
    try:
        found = path.stat()
        _check(path, found, limit, error, hint)
        # Without waiting, should a pipe take the file's place: it has no end.
        with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            _check(path, os.fstat(file.fileno()), limit, error, hint)
            content = file.read(limit + 1)
    except (OSError, ValueError) as problem:
        # A name with a null byte is a ValueError.
        reason = getattr(problem, "strerror", None) or problem
        raise error(f"{path}: cannot be read: {reason}{hint}") from problem
    if len(content) > limit:
        # Some files of the system say that they are empty, and grow while they are read.
        raise error(f"{path}: found more than {limit} bytes, expected at most {limit}{hint}")
    return content


def read_text(
    path: Path, limit: int = MEGABYTE, error: type[GarlError] = ScenarioError, hint: str = ""
) -> str:
    """Return the UTF-8 text in a regular file of at most ``limit`` bytes, as it is.

    Raises ``error`` as :func:`read_bytes` does, and if it is not UTF-8.
    """
    try:
        return read_bytes(path, limit, error, hint).decode()
    except UnicodeDecodeError as problem:
        raise error(f"{path}: cannot be read: {problem}{hint}") from problem


def _check(
    path: Path, found: os.stat_result, limit: int, error: type[GarlError], hint: str
) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for test, name in _KINDS if test(found.st_mode)), "something else")
        raise error(f"{path}: cannot be read: found {kind}, expected a regular file{hint}")
    if found.st_size > limit:
        raise error(f"{path}: found {found.st_size} bytes, expected at most {limit}{hint}")
