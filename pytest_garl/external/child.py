"""A program in a process of its own that answers each line on its stdin by one on its stdout."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import select
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Literal

from pytest_garl import cpu_dispatch
from pytest_garl.messages import shortened
from pytest_garl.process_tree import descendants_of, kill
from pytest_garl.program import ProgramFailedError, end_in_words

LONGEST_LINE = 2**20
"""Bytes of an answer: 1,000 points of a path and 100 detections take a tenth."""
SAID_BYTES = 4096
"""How much of what a program wrote to stderr is kept: its end says why it died."""
ENDING_S = 1.0
"""How long a program may take to end when its stdin is closed; then it is killed."""
REASON = re.compile(r"^(?:[\w.]*(?:Error|Exception)\b.*|\s*what\(\):.*)$", re.MULTILINE)
"""What Python and C++ write of an exception that nobody has caught."""
QUIET_S = 2.0
"""After so much time without an answer it is said on stderr what is waited for: if the call then
takes too long, the report of it has that line."""
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_prctl = getattr(ctypes.CDLL(None), "prctl", None)


class Child:
    """The process of a program, from its start until ``close``.

    It ends with the process that started it.  What it writes to stderr is read and its end is kept,
    so it can neither block on it nor fill a terminal.
    """

    def __init__(
        self, name: str, command: Sequence[str], folder: Path, environment: Mapping[str, str]
    ) -> None:
        self._name = name
        self._said = self._answered = b""
        try:
            self._process = subprocess.Popen(
                command,
                cwd=folder,
                env={**os.environ, **cpu_dispatch.environment_of_programs(), **environment},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                bufsize=0,
                process_group=0,
                preexec_fn=_end_with_parent,
            )
        except (OSError, subprocess.SubprocessError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise self.failure(
                "died", "NotStarted", f"{command[0]} cannot be started in {folder.name}/: {reason}"
            ) from None
        self._end = weakref.finalize(self, _end, self._process)
        self._poll = select.poll()
        for stream in (self._stdout, self._stderr):
            os.set_blocking(stream.fileno(), False)
            self._poll.register(stream, select.POLLIN)

    @property
    def _stdout(self) -> IO[bytes]:
        assert self._process.stdout is not None
        return self._process.stdout

    @property
    def _stderr(self) -> IO[bytes]:
        assert self._process.stderr is not None
        return self._process.stderr

    def ask(self, line: bytes, what: str) -> bytes:
        """Write a line and return the line that answers it; ``what`` names the request.

        Raises ProgramFailedError if the program has ended, or writes no end of a line.  A line too
        many is taken for the next answer, so that it does not matter when it arrives.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(line + b"\n")
        except BrokenPipeError:
            raise self._ended(what) from None
        self._wait_for_line(what)
        answer, _, self._answered = self._answered.partition(b"\n")
        return answer

    def _wait_for_line(self, what: str) -> None:
        told = time.monotonic() + QUIET_S
        while b"\n" not in self._answered:
            if len(self._answered) > LONGEST_LINE:
                raise self.failure(
                    "nonsense",
                    "BadMessage",
                    f"answered {what} with more than {LONGEST_LINE} bytes without the end of a "
                    f"line, beginning with {self._answered[:40]!r}; expected one line of JSON",
                )
            ready = dict(self._poll.poll(1000 * QUIET_S))
            if self._stderr.fileno() in ready:
                self._read_stderr()
            if self._stdout.fileno() in ready:
                data = os.read(self._stdout.fileno(), 2**16)
                if not data:
                    raise self._ended(what)
                self._answered += data
            elif time.monotonic() > told:
                self._read_stderr()
                said = f"; it said last: {shortened(self.said[-400:], 300)}" if self.said else ""
                sys.stderr.write(f"waiting for {self._name} to answer {what}{said}\n")
                told = float("inf")

    def _read_stderr(self) -> None:
        # A program that writes without end must not keep this process here.
        for _ in range(16):
            try:
                data = os.read(self._stderr.fileno(), 2**16)
            except BlockingIOError:
                return
            if not data:
                with contextlib.suppress(KeyError):
                    self._poll.unregister(self._stderr)
                return
            self._said = (self._said + data)[-SAID_BYTES:]

    @property
    def said(self) -> str:
        """The end of what the program wrote to stderr."""
        return self._said.decode(errors="replace").strip()

    def failure(
        self, kind: Literal["died", "nonsense"], error: str, message: str
    ) -> ProgramFailedError:
        """Return the error for something that went wrong with the program."""
        return ProgramFailedError(
            error, f"{self._name} {message}", where=self._name, trace=self.said, kind=kind
        )

    def _ended(self, what: str) -> ProgramFailedError:
        """Return the error for a program that closed its stdin or stdout, most often by ending."""
        ended = _wait(self._process, ENDING_S)
        self._read_stderr()
        if not ended:
            message = f"closed its stdin or stdout before it answered {what}, and runs on"
            return self.failure("died", "Closed", message)
        error, how = end_in_words(self._status())
        reasons = REASON.findall(self.said)
        reason = f": {shortened(reasons[-1].strip(), 300)}" if reasons else ""
        return self.failure("died", error, f"ended with {how} before it answered {what}{reason}")

    def _status(self) -> int:
        """Return the status of a process that has ended, and leave it to be waited for."""
        found = os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOWAIT)
        assert found is not None
        return found.si_status if found.si_code == os.CLD_EXITED else -found.si_status

    def close(self) -> None:
        """End the process: its stdin closes, and what is left of its group is killed."""
        self._end()


def _end(process: subprocess.Popen[bytes]) -> None:
    started = descendants_of(process.pid)
    with contextlib.suppress(OSError):
        if process.stdin is not None:
            process.stdin.close()
    _wait(process, ENDING_S)
    kill(started)
    # Nobody has taken its status yet, so its group cannot be another one's by now.
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    for stream in (process.stdout, process.stderr):
        if stream is not None:
            stream.close()


def _wait(process: subprocess.Popen[bytes], limit_s: float) -> bool:
    """Wait until a process has ended, and leave its status; return whether it has."""
    file = os.pidfd_open(process.pid)
    try:
        return bool(select.select([file], [], [], limit_s)[0])
    finally:
        os.close(file)


def _end_with_parent() -> None:
    """Have the kernel kill this process when the one that started it ends; adopt its orphans."""
    if _prctl is not None:
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        _prctl(_PR_SET_CHILD_SUBREAPER, 1)
