"""Atomic writing of text files, and a lock for processes that write into the same folder."""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from pytest_garl.errors import SavingError


def write_text_atomically(path: Path, text: str) -> Path:
    """Write a file atomically and return its path; make its folder if it is missing."""
    return write_bytes_atomically(path, text.encode())


def write_bytes_atomically(path: Path, content: bytes) -> Path:
    """Write a file atomically and return its path; make its folder if it is missing.

    Raises SavingError if it cannot be written.
    """
    incomplete = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with incomplete.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        incomplete.replace(path)
    except OSError as error:
        raise SavingError(f"{path}: cannot be saved ({error})") from error
    return path


def check_writable(path: Path) -> None:
    """Raise SavingError unless a file can be written to ``path``; nothing is left there."""
    if path.is_dir():
        raise SavingError(f"{path}: found a folder, expected the name of a file")
    folder = next(each for each in path.absolute().parents if each.exists())
    try:
        # Access rights alone say nothing of a file system that is full or cannot be written.
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise SavingError(
            f"{path}: cannot be written ({error.strerror}); name a file elsewhere"
        ) from error


@contextlib.contextmanager
def locked(folder: Path, tell_of_wait: Callable[[], None] | None = None) -> Iterator[None]:
    """Lock a folder, so that one process at a time reads and then changes its files.

    ``tell_of_wait`` is called if another process has it.  Raises SavingError if there is no such
    folder and none can be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # The folder itself is locked: a file for the purpose would have to be ignored by git.
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise SavingError(
            f"{folder}: nothing can be saved here ({error}); choose another folder of cases "
            "with the ini key garl_cases"
        ) from error
    # Windows has no fcntl; nothing is saved there.
    import fcntl

    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if tell_of_wait:
                tell_of_wait()
            fcntl.flock(handle, fcntl.LOCK_EX)
        _remove_incomplete(folder)
        yield
    finally:
        os.close(handle)


def _remove_incomplete(folder: Path) -> None:
    """Remove the incomplete files of processes that were killed while writing."""
    for path in folder.glob(".*"):
        found = re.fullmatch(r"\..+\.(\d+)", path.name)
        if found and not _exists(int(found[1])):
            path.unlink(missing_ok=True)


def _exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        # The process is another user's.
        return True
    return True
