"""A program in a process of its own that answers each line on its stdin by one on its stdout."""

from __future__ import annotations

import ctypes
import os
import re
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from pytest_garl.messages import shortened
from pytest_garl.program import ProgramFailedError, ProgramOutput, end_in_words
from pytest_garl.program_process import ProgramProcess, has_ended

LONGEST_LINE = 2**20
"""Bytes of an answer: 1,000 points of a path and 100 detections take a tenth."""
ENDING_S = 1.0
"""How long a program may take to end when its stdin is closed; then it is killed."""
REASON = re.compile(r"^(?:[\w.]*(?:Error|Exception)\b.*|\s*what\(\):.*)$", re.MULTILINE)
"""What Python and C++ write of an exception that nobody has caught."""
QUIET_S = 2.0
"""After this time without an answer, stderr says what is waited for.  If the call then takes too
long, its report has that line."""
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_prctl = getattr(ctypes.CDLL(None), "prctl", None)


class Child(ProgramProcess):
    """The process of a program, from its start until ``close``.

    It ends with the process that started it.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        output: ProgramOutput | None = None,
    ) -> None:
        super().__init__(
            name,
            command,
            folder,
            environment,
            output=output,
            ending_s=ENDING_S,
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            process_group=0,
            preexec_fn=_end_with_parent,
        )
        self._answered = b""
        assert self._process.stdout is not None
        self._answers = self._process.stdout.fileno()
        os.set_blocking(self._answers, False)
        self._ready.register(self._answers, selectors.EVENT_READ)

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
                    "BadMessage",
                    f"answered {what} with more than {LONGEST_LINE} bytes without the end of a "
                    f"line, beginning with {self._answered[:40]!r}; expected one line of JSON",
                    "nonsense",
                )
            if self._answers in self.ready(QUIET_S):
                data = os.read(self._answers, 2**16)
                if not data:
                    raise self._ended(what)
                self._answered += data
            elif time.monotonic() > told:
                self.read_said()
                said = f"; it said last: {shortened(self.said[-400:], 300)}" if self.said else ""
                sys.stderr.write(f"waiting for {self._name} to answer {what}{said}\n")
                told = float("inf")

    def _ended(self, what: str) -> ProgramFailedError:
        """Return the error for a program that closed its stdin or stdout, most often by ending."""
        ended = has_ended(self._process, ENDING_S)
        self.read_said()
        if not ended:
            message = f"closed its stdin or stdout before it answered {what}, and runs on"
            return self.failure("Closed", message)
        error, how = end_in_words(self._status())
        reasons = REASON.findall(self.said)
        reason = f": {shortened(reasons[-1].strip(), 300)}" if reasons else ""
        return self.failure(error, f"ended with {how} before it answered {what}{reason}")

    def _status(self) -> int:
        """Return the status of a process that has ended, and leave it to be waited for."""
        found = os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOWAIT)
        assert found is not None
        return found.si_status if found.si_code == os.CLD_EXITED else -found.si_status


def _end_with_parent() -> None:
    """Have the kernel kill this process when the one that started it ends; adopt its orphans."""
    if _prctl is not None:
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        _prctl(_PR_SET_CHILD_SUBREAPER, 1)
