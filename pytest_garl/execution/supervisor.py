"""The process between a pool and a flying one: watches it, ends it, and tells how it ended.

The flying process runs the landing system's code and can be trusted with nothing: it may hold the
interpreter for ever, close its files, replace ``time.time`` or be killed.  So its limits are
watched, and its end is told, by a process that has never run a line of the landing system: the
flying process is forked from it.  The two share a page of memory.  The supervisor also inherits
whatever the landing system leaves behind, and ends it.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import mmap
import os
import secrets
import select
import signal
import sys
import traceback
from collections.abc import Callable
from os import _exit, getpid
from pathlib import Path
from time import monotonic, sleep
from typing import Any, NoReturn

from pytest_garl.execution.processes import (
    Parent,
    adopt_orphans,
    children_of,
    end_with,
    reason,
)

POLL_MS = 50
SAID_BYTES = 2**14
"""How much is kept of what a flying process said on stderr: its end says why it died."""
STANDSTILL = 12
"""A flight in which the landing system is not called for so many limits of a call stands still: a
thread holds the interpreter, or an import does not come back.  The simulator's own work between two
calls takes a second at most."""
LEAST_STANDSTILL_S = 120.0
TURN = 16
"""How many pieces of what is said on stderr are read before the limits are looked at again."""
DUMP_S = 2.0
"""How long a process that hangs may take to say where."""
ENDING_S = 5.0
_DUMP = signal.SIGRTMAX
_STDERR = 2
_BEGAN, _LIMIT, _MOVED, _ENDING, _LENGTH = range(5)
_TEXT = 64
_MEMORY_BYTES = 2**16


class Watch:
    """What a flying process notes, in memory that its supervisor reads.

    To note the begin and the end of a call takes less than a microsecond: a flight control is
    called 240 times a second.  Only the landing system's own calls count; what the simulator does
    between them is its own affair, unless nothing goes on at all.
    """

    def __init__(self) -> None:
        self._memory = mmap.mmap(-1, _MEMORY_BYTES)
        self._numbers = memoryview(self._memory)[:_TEXT].cast("d")
        self.mark = f"\n{secrets.token_hex(16)}\n".encode()
        """Written to stderr where a flight begins: earlier ones explain nothing about its end."""

    def step_begins(self) -> None:
        """Note that the landing system is called."""
        self._numbers[_BEGAN] = monotonic()

    def step_ends(self) -> None:
        """Note that it came back."""
        self._numbers[_MOVED] = monotonic()
        self._numbers[_BEGAN] = 0.0

    def flight_begins(self, limit_s: float) -> None:
        """Have calls watched that take longer than the limit."""
        with contextlib.suppress(OSError):
            os.write(_STDERR, self.mark)
        self._numbers[_MOVED] = monotonic()
        self._numbers[_LIMIT] = limit_s

    def flight_ends(self) -> None:
        """Have nothing watched; do not come back if the supervisor ends this process already."""
        self._numbers[_LIMIT] = self._numbers[_BEGAN] = 0.0
        while self._numbers[_ENDING]:
            sleep(1)

    def overdue(self) -> str:
        """Return what takes too long, as the beginning of a sentence, or nothing."""
        began, limit_s, moved = self._numbers[: _MOVED + 1]
        if not limit_s:
            return ""
        if began:
            late = monotonic() > began + limit_s
            return f"one call took longer than {limit_s:g} s of wall time" if late else ""
        still_s = max(LEAST_STANDSTILL_S, STANDSTILL * limit_s)
        late = monotonic() > moved + still_s
        return f"neither it nor the simulator went on for {still_s:g} s" if late else ""

    def is_ended(self) -> None:
        """Note that the flying process will be ended: it shall record nothing any more."""
        self._numbers[_ENDING] = 1.0

    def tell(self, **facts: Any) -> None:
        """Leave a message to the supervisor, shortened to what there is room for."""
        room = _MEMORY_BYTES - _TEXT
        text = json.dumps(facts).encode()
        if len(text) > room:
            short = {key: str(value)[-room // 8 :] for key, value in facts.items()}
            text = json.dumps(short).encode()
        self._memory[_TEXT : _TEXT + len(text)] = text
        self._numbers[_LENGTH] = len(text)

    def told(self) -> dict[str, Any]:
        """Return the message."""
        length = int(self._numbers[_LENGTH])
        facts: dict[str, Any] = json.loads(self._memory[_TEXT : _TEXT + length]) if length else {}
        return facts


def supervise(parent: Parent, fly: Callable[[Watch], None], failing: str) -> NoReturn:
    """Run ``fly`` in a process of its own; tell the parent how it ended, and leave nothing running.

    ``failing`` says what it is that failed where ``fly`` raises an error that is not on purpose.
    """
    watch = Watch()
    reading, writing = os.pipe()
    adopt_orphans()
    me = getpid()
    flying = os.fork()
    if not flying:
        os.close(reading)
        os.close(parent.report)
        os.dup2(writing, _STDERR)
        os.close(writing)
        _fly(me, watch, fly, failing)
    os.close(writing)
    _Supervisor(parent, watch, flying, reading).run()


def _fly(supervisor: int, watch: Watch, fly: Callable[[Watch], None], failing: str) -> NoReturn:
    """Be the flying process: it ends here, whatever the landing system does or leaves."""
    status = 1
    try:
        end_with(supervisor, signal.SIGKILL)
        adopt_orphans()
        with contextlib.suppress(OSError):
            # Short of memory the kernel shall end the flight, and neither pytest nor a neighbour.
            Path("/proc/self/oom_score_adj").write_text("1000")
        faulthandler.enable()
        faulthandler.register(_DUMP, all_threads=True)
        fly(watch)
        status = 0
    except SystemExit as error:
        if isinstance(error.code, str):
            os.write(_STDERR, error.code.encode())
        status = error.code if isinstance(error.code, int) else int(error.code is not None)
    except Exception as error:  # noqa: BLE001 (told to the pool, which raises it)
        watch.tell(cannot_go_on=reason(error, failing))
    except BaseException:  # noqa: BLE001 (such as a KeyboardInterrupt of the landing system's own)
        traceback.print_exc(file=sys.stderr)
    finally:
        # Not by sys.exit: the interpreter would wait for threads that a landing system left.
        _exit(status & 0xFF)


class _ToldToEndError(BaseException):
    """Raised where the parent asks this process to end, or is gone."""


class _Supervisor:
    def __init__(self, parent: Parent, watch: Watch, flying: int, stderr: int) -> None:
        self._parent, self._watch, self._flying = parent, watch, flying
        self._stderr = stderr
        self._poll = select.poll()
        self._poll.register(stderr, select.POLLIN)
        self._listens = True
        self._said = b""
        self._words = b""
        self._hung = ""

    def run(self) -> NoReturn:
        """Watch until the flying process has ended or the parent wants it to."""
        try:
            signal.signal(signal.SIGTERM, _end)
            status = self._ended()
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            self._listen(0)
            end_descendants()
            self._parent.tell(
                status=status,
                hung=self._hung,
                words=self._words.decode(errors="replace"),
                complaint=self._said.decode(errors="replace"),
                **self._watch.told(),
            )
        except _ToldToEndError:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            end_descendants()
        finally:
            _exit(0)

    def _ended(self) -> int:
        """Return the status of the flying process when it has ended; a signal's is negative."""
        while True:
            pid, status = os.waitpid(self._flying, os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            if not self._parent.lives():
                raise _ToldToEndError
            self._hung = self._hung or self._watch.overdue()
            if self._hung:
                self._stop()
            self._listen(POLL_MS)

    def _stop(self) -> None:
        """End a process that hangs, after it has said where."""
        self._watch.is_ended()
        before, self._said = self._said, b""
        os.kill(self._flying, _DUMP)
        until = monotonic() + DUMP_S
        while monotonic() < until and (self._listen(POLL_MS) or not self._said):
            pass
        self._words, self._said = self._said, before
        os.kill(self._flying, signal.SIGKILL)

    def _listen(self, patience_ms: int) -> bool:
        """Read what was said on stderr; return whether there was any."""
        heard = False
        # Who never stops talking is not listened to for ever.
        for _ in range(TURN):
            if not self._listens or not self._poll.poll(patience_ms):
                break
            data = os.read(self._stderr, 2**16)
            if not data:
                self._poll.unregister(self._stderr)
                self._listens = False
                break
            heard, patience_ms = True, 0
            said = (self._said + data).rpartition(self._watch.mark)[2]
            self._said = said[-SAID_BYTES - len(self._watch.mark) :]
        if not self._listens and not heard:
            sleep(patience_ms / 1000)
        return heard


def _end(number: int, frame: object) -> NoReturn:
    raise _ToldToEndError


def end_descendants() -> None:
    """End all processes below this one, in whatever session; those of ended ones come to it."""
    until = monotonic() + ENDING_S
    while monotonic() < until:
        for pid in children_of(getpid()):
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return
        sleep(0.002)
