"""How a child process is tied to the process that started it, and what it tells that.

Linux has the kernel tie a process to its parent.  Where it does not, as on macOS, a thread looks
for the parent.
"""

from __future__ import annotations

import ctypes
import dataclasses
import json
import os
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic, sleep
from typing import Any

from pytest_garl.errors import GarlError

LONGEST_LOOK_S = 1.0
"""At most this much of the time between two looks at a heartbeat counts."""
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_LOOKS_EVERY_S = 0.5
"""How often a process looks for its parent where the kernel does not."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerReport:
    """What a worker process, or its supervisor, tells the process that started it.

    ``status`` is the exit status of the flying process, negative for a signal.  ``hung`` says what
    took too long, ``stacks`` are the stacks of that moment, ``stderr`` is the end of its stderr.
    ``failure`` is type, message and traceback of an error that may be the flight's own, and
    ``cannot_go_on`` an error that would occur in any other worker as well.
    """

    status: int | None = None
    hung: str = ""
    stacks: str = ""
    stderr: str = ""
    failure: tuple[str, str, str] | None = None
    cannot_go_on: str = ""

    def dumps(self, room: int | None = None) -> bytes:
        """Return it as JSON; of texts that do not fit into ``room`` bytes both ends are kept."""
        report, characters = self, room or 0
        while len(text := json.dumps(dataclasses.asdict(report)).encode()) > (room or len(text)):
            characters //= 2
            report = self._shortened(characters)
        return text

    def _shortened(self, characters: int) -> WorkerReport:
        def ends(text: str) -> str:
            half = characters // 2
            return text if len(text) <= characters else f"{text[:half]}\n...\n{text[-half:]}"

        kind, message, text = self.failure or ("", "", "")
        return dataclasses.replace(
            self,
            stacks=ends(self.stacks),
            stderr=ends(self.stderr),
            failure=(ends(kind), ends(message), ends(text)) if self.failure else None,
            cannot_go_on=ends(self.cannot_go_on),
        )

    @classmethod
    def loads(cls, text: bytes) -> WorkerReport | None:
        """Return the report that JSON holds, or None if there is none."""
        found: dict[str, Any] = json.loads(text) if text else {}
        known = {
            each.name: found[each.name] for each in dataclasses.fields(cls) if each.name in found
        }
        failure = known.get("failure")
        return cls(**{**known, "failure": tuple(failure) if failure else None}) if known else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Parent:
    """The process that started this one, and the file for this one's last report to it.

    The file has no name and no other process writes it, so the output of a landing system is never
    taken for a report.
    """

    pid: int
    file: int

    @classmethod
    def of_this_process(cls) -> Parent:
        """Return the parent whose id and file are the first two arguments of this process."""
        pid, file = sys.argv[1:3]
        return cls(pid=int(pid), file=int(file))

    def lives(self) -> bool:
        """Return whether the parent still exists."""
        return os.getppid() == self.pid

    def beat(self) -> None:
        """Show the parent that this process goes on: the file's time of change is later."""
        os.utime(self.file)

    def report(self, report: WorkerReport) -> None:
        """Write a report; it replaces an earlier one."""
        os.ftruncate(self.file, 0)
        os.pwrite(self.file, report.dumps(), 0)


def create_report_file() -> int:
    """Return the descriptor of a file without a name for the report of a child process."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("garl-report")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def read_report(file: int) -> WorkerReport | None:
    """Return the report of a child process that has ended; None if it was killed."""
    return WorkerReport.loads(os.pread(file, os.fstat(file).st_size, 0))


class Heartbeat:
    """Whether a child process goes on: it beats by changing the time of its report's file."""

    def __init__(self, file: int) -> None:
        self._file = file
        self._last_ns = os.fstat(file).st_mtime_ns
        self._beats = False
        self._looked_s = monotonic()
        self._silent_s = 0.0

    def silent_s(self) -> float:
        """Return for how long a child that has beaten before has not, in this process's time.

        Only time counts in which this process looked: if all processes of a machine stood still,
        the child may wake later than this one.
        """
        now, last_ns = monotonic(), os.fstat(self._file).st_mtime_ns
        if last_ns != self._last_ns:
            self._beats, self._last_ns, self._silent_s = True, last_ns, 0.0
        elif self._beats:
            self._silent_s += min(now - self._looked_s, LONGEST_LOOK_S)
        self._looked_s = now
        return self._silent_s


def end_with_parent(parent: int, number: int = signal.SIGTERM, *, forks: bool = False) -> None:
    """Send this process a signal when its parent ends: by the kernel, if it can.

    Otherwise a thread does.  A process that ``forks`` must have no threads: there it has to look
    for its parent itself, by ``Parent.lives``.
    """
    if not _prctl(_PR_SET_PDEATHSIG, number) and not forks:
        threading.Thread(target=_await_end, args=(parent, number), daemon=True).start()
    if os.getppid() != parent:
        # The parent ended before the call of prctl.
        os._exit(1)


def _await_end(parent: int, number: int) -> None:
    while os.getppid() == parent:
        sleep(_LOOKS_EVERY_S)
    os.kill(os.getpid(), number)


def _prctl(option: int, value: int) -> bool:
    """Call prctl; return whether the system has it."""
    function = getattr(ctypes.CDLL(None), "prctl", None)
    if function is not None:
        function(option, value)
    return function is not None


def ignore_ctrl_c() -> None:
    """Ignore SIGINT, which a terminal sends to all processes: the parent ends this one in order."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def adopt_orphans() -> None:
    """Become the parent of all processes below this one whose own parent ends, in any session.

    Without prctl such a process is left behind if it has left its session.
    """
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)


def run_worker(main: Callable[..., None], component: str) -> None:
    """Run ``main`` with the parent and the other arguments; report an error to the parent.

    ``component`` names what failed if the error is not one of pytest-garl's own.
    """
    parent = Parent.of_this_process()
    ignore_ctrl_c()
    end_with_parent(parent.pid, forks=True)
    try:
        main(parent, *sys.argv[3:])
    except Exception as error:  # noqa: BLE001 (the pool raises it)
        parent.report(WorkerReport(cannot_go_on=failure_text(error, component)))
        sys.exit(1)


def failure_text(error: Exception, component: str) -> str:
    """Return the text of an error that would occur in any other worker as well."""
    if isinstance(error, GarlError):
        return str(error)
    text = "".join(traceback.format_exception(error))
    return f"{component} failed in a worker process:\n{text}"
