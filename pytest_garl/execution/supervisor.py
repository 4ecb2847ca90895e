"""The supervisor of a flying process: enforces its time limits and reports how it ended.

A worker is two processes.  The flying process runs the landing system's code, which may hold the
interpreter for ever, close files, replace ``time.time`` or be killed.  The supervisor never runs a
line of that code.  A flight, in steps:

1. The supervisor forks the flying process, with one page of memory that both see and a pipe for its
   stderr.  Forks are used because a start takes a second, and flights take three.
2. Before each call of the landing system the flying process notes the time in that page, and a zero
   after it (:class:`FlightMonitor`).  That costs less than a microsecond and no system call, since
   the flight control calls 240 times a second.
3. The supervisor looks at the page each time it waits for stderr, twenty times a second.  If a
   call takes too long it asks for the stacks by a signal, waits for them a moment, and kills the
   process: no thread of the interpreter could do that.
4. The flying process writes the flight's record and asks for a verdict.  The supervisor reads the
   record and judges it here, where nothing has replaced ``math.hypot``.
5. It ends what the landing system has left behind: children, and children of children that left
   their session.  If there was something, the next flight gets a fresh process.
6. It shows four times a second that it goes on, since a landing system may stop it by a signal; the
   pool ends both if it does not.

The order is that of what can still be known: stacks before the kill, the end of stderr before the
process is forgotten, the verdict before the worker takes the next slot.

An example: a call waits for a lock for ever, with a limit of 10 s.  At 10 s the supervisor takes
the stacks, which name file and line, and kills the process.  The flight is repeated alone with
three times the limit; if it hangs again, that is a finding of type V with these stacks.
"""

from __future__ import annotations

import contextlib
import dataclasses
import faulthandler
import json
import mmap
import os
import secrets
import select
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from os import _exit, getpid
from pathlib import Path
from time import monotonic, sleep
from typing import Any, NoReturn

from pytest_garl.execution.processes import (
    Parent,
    WorkerReport,
    adopt_orphans,
    end_with_parent,
    failure_text,
    ignore_ctrl_c,
)
from pytest_garl.process_tree import alive, children_of, descendants_of, kill

STDERR_WAIT_MS = 50
"""How long the supervisor waits for stderr before it looks at the limits again."""
STDERR_BYTES = 2**14
"""How much of a flying process's stderr is kept; its end says why the process died."""
STANDSTILL = 12
"""If the landing system is not called for this many limits of a call, the flight stands still: a
thread holds the interpreter, or an import does not return.  The simulator's own work between two
calls takes a second at most."""
LEAST_STANDSTILL_S = 120.0
STDERR_READS = 16
"""How many pieces of stderr are read before the limits are looked at again."""
DUMP_S = 2.0
"""How long a process that hangs may take to dump its stacks."""
ENDING_S = 5.0
"""How long the supervisor tries to end the processes below it."""
BEAT_EVERY_S = 0.25
"""How often the supervisor shows that it goes on: a landing system may stop it by a signal."""
ANSWER_EVERY_S = 0.001
"""How often a flying process looks whether its flight is judged; that takes 20 ms."""
_DUMP: int = getattr(signal, "SIGRTMAX", signal.SIGUSR2)
"""A signal that nobody else sends; macOS has none that is free."""
_STDERR = 2
_BEGAN, _LIMIT, _MOVED, _ENDING, _LENGTH, _ASKED = range(6)
_TEXT = 64
_MEMORY_BYTES = 2**16
_WAITS, _GOES_ON, _ENDS = 1.0, 0.0, 2.0
"""What is known of a request: it waits for an answer, or the flying process goes on or ends."""

JudgeFunction = Callable[[dict[str, Any], Callable[[], None]], WorkerReport | None]
"""Takes a request of the flying process, and what ends that process, and judges; returns the report
with which that process must end, or None if it may go on."""


class FlightMonitor:
    """Notes of a flying process, in memory that its supervisor reads.

    Noting the begin and the end of a call takes less than a microsecond, since the flight control
    calls 240 times a second.  The limit applies to the landing system's calls alone; the
    simulator's work between them counts only if the whole flight stands still.
    """

    def __init__(self) -> None:
        self._memory = mmap.mmap(-1, _MEMORY_BYTES)
        self._numbers = memoryview(self._memory)[:_TEXT].cast("d")
        self.mark = f"\n{secrets.token_hex(16)}\n".encode()
        """Written to stderr when a flight begins: only later output explains how it ended."""

    def step_begins(self) -> None:
        """Note that the landing system is called."""
        self._numbers[_BEGAN] = monotonic()

    def step_ends(self) -> None:
        """Note that the call returned."""
        self._numbers[_MOVED] = monotonic()
        self._numbers[_BEGAN] = 0.0

    def flight_begins(self, limit_s: float) -> None:
        """Note that a flight begins, and the limit of its calls."""
        with contextlib.suppress(OSError):
            os.write(_STDERR, self.mark)
        self._numbers[_MOVED] = monotonic()
        self._numbers[_LIMIT] = limit_s

    def flight_ends(self) -> None:
        """Note that no limit applies; wait for ever if the supervisor is ending this process."""
        self._numbers[_LIMIT] = self._numbers[_BEGAN] = 0.0
        while self._numbers[_ENDING]:
            sleep(1)

    def request(self, **facts: Any) -> bool:
        """Have the supervisor judge a flight; return whether this process may fly another one."""
        self._write(json.dumps(facts).encode())
        self._numbers[_ASKED] = _WAITS
        # The supervisor waits for output; if there is no stderr any more, it looks a bit later.
        with contextlib.suppress(OSError):
            os.write(_STDERR, self.mark)
        while self._numbers[_ASKED] == _WAITS or self._numbers[_ENDING]:
            sleep(ANSWER_EVERY_S)
        return bool(self._numbers[_ASKED] == _GOES_ON)

    def requested(self) -> dict[str, Any] | None:
        """Return the request that waits for an answer, or None."""
        if self._numbers[_ASKED] != _WAITS:
            return None
        facts: dict[str, Any] = json.loads(self._text())
        return facts

    def answer(self, *, goes_on: bool) -> None:
        """Let the flying process go on, or end."""
        self._numbers[_LENGTH] = 0.0
        self._numbers[_ASKED] = _GOES_ON if goes_on else _ENDS

    def overdue(self) -> str:
        """Return what takes too long as the beginning of a sentence; empty if nothing does."""
        began, limit_s, moved = self._numbers[: _MOVED + 1]
        if not limit_s:
            return ""
        if began:
            late = monotonic() > began + limit_s
            return f"one call took longer than {limit_s:g} s of wall time" if late else ""
        still_s = max(LEAST_STANDSTILL_S, STANDSTILL * limit_s)
        late = monotonic() > moved + still_s
        return f"neither it nor the simulator went on for {still_s:g} s" if late else ""

    def note_ending(self) -> None:
        """Note that the flying process is being ended, so that it records nothing more."""
        self._numbers[_ENDING] = 1.0

    def report(self, report: WorkerReport) -> None:
        """Leave a report to the supervisor; long texts are shortened to the room there is."""
        self._write(report.dumps(_MEMORY_BYTES - _TEXT))

    def reported(self) -> WorkerReport | None:
        """Return the report, or None if there is none."""
        return WorkerReport.loads(self._text())

    def _write(self, text: bytes) -> None:
        self._memory[_TEXT : _TEXT + len(text)] = text
        self._numbers[_LENGTH] = len(text)

    def _text(self) -> bytes:
        return self._memory[_TEXT : _TEXT + int(self._numbers[_LENGTH])]


def supervise(
    parent: Parent,
    fly: Callable[[FlightMonitor], None],
    judge: JudgeFunction,
    component: str,
) -> NoReturn:
    """Run ``fly`` in a process of its own; report to the parent how it ended, and end the rest.

    ``judge`` judges in this process the flights of the other one.  ``component`` names what failed
    if ``fly`` raises an error that is not one of pytest-garl's own.
    """
    monitor = FlightMonitor()
    reading, writing = os.pipe()
    adopt_orphans()
    me = getpid()
    flying = os.fork()
    if not flying:
        os.close(reading)
        os.close(parent.file)
        os.dup2(writing, _STDERR)
        os.close(writing)
        _fly(me, monitor, fly, component)
    os.close(writing)
    _Supervisor(parent, monitor, flying, reading, judge).run()


def _fly(
    supervisor: int,
    monitor: FlightMonitor,
    fly: Callable[[FlightMonitor], None],
    component: str,
) -> NoReturn:
    """Run the flying process; it ends here, whatever the landing system does or leaves behind."""
    status = 1
    try:
        ignore_ctrl_c()
        end_with_parent(supervisor, signal.SIGKILL)
        adopt_orphans()
        with contextlib.suppress(OSError):
            # If memory is short, the kernel shall end the flight first, not pytest.
            Path("/proc/self/oom_score_adj").write_text("1000")
        faulthandler.enable()
        faulthandler.register(_DUMP, all_threads=True)
        fly(monitor)
        status = 0
    except SystemExit as error:
        if isinstance(error.code, str):
            os.write(_STDERR, error.code.encode())
        status = error.code if isinstance(error.code, int) else int(error.code is not None)
    except Exception as error:  # noqa: BLE001 (the pool raises it)
        monitor.report(WorkerReport(cannot_go_on=failure_text(error, component)))
    except BaseException:  # noqa: BLE001 (such as a landing system's own KeyboardInterrupt)
        traceback.print_exc(file=sys.stderr)
    finally:
        # Not by sys.exit: the interpreter would wait for threads of the landing system.
        _exit(status & 0xFF)


class _EndRequestedError(BaseException):
    """Raised if the parent asks this process to end, or has ended."""


class _Supervisor:
    def __init__(
        self,
        parent: Parent,
        monitor: FlightMonitor,
        flying: int,
        stderr: int,
        judge: JudgeFunction,
    ) -> None:
        self._parent, self._monitor, self._flying = parent, monitor, flying
        self._stderr, self._judge = stderr, judge
        self._judged: WorkerReport | None = None
        self._poll = select.poll()
        self._poll.register(stderr, select.POLLIN)
        self._is_open = True
        self._text = b""
        self._stacks = b""
        self._hung = ""

    def run(self) -> NoReturn:
        """Supervise until the flying process has ended or the parent asks for the end."""
        try:
            signal.signal(signal.SIGTERM, _request_end)
            # A thread: to judge a long record takes longer than the time between two beats.
            threading.Thread(target=self._beat, daemon=True).start()
            status = self._wait()
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            self._read_stderr(0)
            end_descendants()
            said = self._judged or self._monitor.reported() or WorkerReport()
            self._parent.report(
                dataclasses.replace(
                    said,
                    status=status,
                    hung=self._hung,
                    stacks=self._stacks.decode(errors="replace"),
                    stderr=self._text.decode(errors="replace"),
                )
            )
        except _EndRequestedError:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            end_descendants()
        finally:
            _exit(0)

    def _beat(self) -> None:
        while True:
            self._parent.beat()
            sleep(BEAT_EVERY_S)

    def _wait(self) -> int:
        """Wait for the flying process to end; return its exit status, a signal's as negative."""
        while True:
            pid, status = os.waitpid(self._flying, os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            if not self._parent.lives():
                raise _EndRequestedError
            if (request := self._monitor.requested()) is not None:
                self._answer(request)
            self._hung = self._hung or self._monitor.overdue()
            if self._hung:
                self._kill()
            self._read_stderr(STDERR_WAIT_MS)

    def _answer(self, request: dict[str, Any]) -> None:
        """Judge a flight, once nothing that it has left runs any more.

        Such a process might hold the ledger's lock.
        """
        left = self._end_what_is_left()
        try:
            self._judged = self._judge(request, self._end_flying)
        except Exception as error:  # noqa: BLE001 (the pool raises it)
            text = failure_text(error, "the judge of flights")
            self._judged = WorkerReport(cannot_go_on=text)
        if self._judged:
            self._end_flying()
        self._monitor.answer(goes_on=not (left or self._judged))

    def _end_flying(self) -> None:
        self._monitor.note_ending()
        os.kill(self._flying, signal.SIGKILL)

    def _end_what_is_left(self) -> bool:
        """End the processes that a flight has left; return whether there were any."""
        left = descendants_of(getpid()) - {self._flying}
        kill(left)
        until = monotonic() + ENDING_S
        while monotonic() < until and any(alive(pid) for pid in left):
            sleep(0.002)
        return bool(left)

    def _kill(self) -> None:
        """Have a process that hangs dump its stacks, then kill it."""
        self._monitor.note_ending()
        before, self._text = self._text, b""
        os.kill(self._flying, _DUMP)
        until = monotonic() + DUMP_S
        while monotonic() < until and (self._read_stderr(STDERR_WAIT_MS) or not self._text):
            pass
        self._stacks, self._text = self._text, before
        os.kill(self._flying, signal.SIGKILL)

    def _read_stderr(self, wait_ms: int) -> bool:
        """Read what there is on stderr; return whether there was anything."""
        found = False
        # A process that writes without end must not keep the supervisor from the limits.
        for _ in range(STDERR_READS):
            if not self._is_open or not self._poll.poll(wait_ms):
                break
            data = os.read(self._stderr, 2**16)
            if not data:
                self._poll.unregister(self._stderr)
                self._is_open = False
                break
            found, wait_ms = True, 0
            text = (self._text + data).rpartition(self._monitor.mark)[2]
            self._text = text[-STDERR_BYTES - len(self._monitor.mark) :]
        if not self._is_open and not found:
            sleep(wait_ms / 1000)
        return found


def _request_end(number: int, frame: object) -> NoReturn:
    raise _EndRequestedError


def end_descendants() -> None:
    """Kill all processes below this one, in any session; orphans among them come to this one."""
    until = monotonic() + ENDING_S
    while monotonic() < until:
        kill(children_of(getpid()))
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return
        sleep(0.002)
