"""Processes: whether others live, and how a child ends with its parent and tells it why."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import GarlError

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36


def alive(pid: int) -> bool:
    """Return whether a process is there and has not ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    # A dead process that nobody has asked about yet is no living one.
    return _state(pid)[:1] != ["Z"]


def named(text: str) -> bool:
    """Return whether a process lives whose command line has this text in it."""
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if os.fsencode(text) in file.read_bytes():
                return True
    return False


def children_of(parent: int) -> Iterator[int]:
    """Yield the processes whose parent is this one, ended ones that nobody asked about included."""
    for folder in Path("/proc").glob("[0-9]*"):
        state = _state(int(folder.name))
        if len(state) > 1 and int(state[1]) == parent:
            yield int(folder.name)


def _state(pid: int) -> list[str]:
    """Return what the kernel says of a process: its state, its parent, and so on."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


@dataclass(frozen=True, slots=True, kw_only=True)
class Parent:
    """The process that started this one, and the file in which it is told how this one ended.

    The file has no name and nobody else writes it: what a landing system prints is never taken for
    a report.
    """

    pid: int
    report: int

    @classmethod
    def of_this_process(cls) -> Parent:
        """Return the parent that started this process with its first two arguments."""
        pid, report = sys.argv[1:3]
        return cls(pid=int(pid), report=int(report))

    def lives(self) -> bool:
        """Return whether it is still there."""
        return os.getppid() == self.pid

    def tell(self, **facts: Any) -> None:
        """Leave a report, in the place of an earlier one."""
        os.ftruncate(self.report, 0)
        os.pwrite(self.report, json.dumps(facts).encode(), 0)


def report_file() -> int:
    """Return the descriptor of a file in memory for the report of a child."""
    return os.memfd_create("garl-report")


def read_report(file: int) -> dict[str, Any]:
    """Return what a child that has ended reported: nothing if it was killed."""
    text = os.pread(file, os.fstat(file).st_size, 0)
    facts: dict[str, Any] = json.loads(text) if text else {}
    return facts


def end_with(parent: int, number: int = signal.SIGTERM) -> None:
    """Tie this process to its parent's life, by a signal, and not to Ctrl-C."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.getppid() != parent:
        # It ended before the kernel was told to say so.
        os._exit(1)


def adopt_orphans() -> None:
    """Become the parent of all below this process whose own parent ends, in whatever session."""
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)


def run_worker(main: Callable[..., None], failing: str) -> None:
    """Run what a child is for, with its parent and its arguments; tell why it cannot go on.

    ``failing`` says what it is that failed where an error was not raised on purpose.
    """
    parent = Parent.of_this_process()
    end_with(parent.pid)
    try:
        main(parent, *sys.argv[3:])
    except Exception as error:  # noqa: BLE001 (told to the pool, which raises it)
        parent.tell(cannot_go_on=reason(error, failing))
        sys.exit(1)


def reason(error: Exception, failing: str) -> str:
    """Return why a process cannot go on: neither can another in its place."""
    if isinstance(error, GarlError):
        return str(error)
    text = "".join(traceback.format_exception(error))
    return f"{failing} failed in a worker process:\n{text}"
