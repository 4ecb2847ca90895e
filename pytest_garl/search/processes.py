"""Processes: whether others live, and how a child says its last words and ends with its parent."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from pytest_garl.errors import GarlError

CANNOT_GO_ON = "garl cannot go on: "
"""With this a child says on stderr that neither it nor another can fly: no place to write, a
policy of objects that fails, a simulator that does."""
_PR_SET_PDEATHSIG = 1


def alive(pid: int) -> bool:
    """Return whether a process is there and has not ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return True
    # A dead process that nobody has asked about yet.
    return fields[0] != "Z"


def named(text: str) -> bool:
    """Return whether a process lives whose command line has this text in it."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if os.fsencode(text) in file.read_bytes():
                return True
    return False


def end_with_parent() -> Callable[[], bool]:
    """Tie this process to its parent's life, not to Ctrl-C; return whether the parent is there."""
    parent = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return lambda: os.getppid() == parent


def run_child(main: Callable[..., None], failing: str) -> None:
    """Run what a child is for, with its arguments; tell the pool why it cannot go on.

    ``failing`` says what it is that failed where an error was not raised on purpose.
    """
    try:
        main(*sys.argv[1:])
    except GarlError as error:
        sys.exit(f"{CANNOT_GO_ON}{error}")
    except Exception:  # noqa: BLE001 (told to the pool, which raises it)
        sys.exit(f"{CANNOT_GO_ON}{failing} failed in a child process:\n{traceback.format_exc()}")
