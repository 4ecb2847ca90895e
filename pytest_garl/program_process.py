"""The process of a program that flies: how it starts, what it says beside its link, how it ends."""

from __future__ import annotations

import contextlib
import os
import select
import selectors
import signal
import subprocess
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from pytest_garl import cpu_dispatch
from pytest_garl.process_tree import descendants_of, kill
from pytest_garl.program import ProgramFailedError, ProgramOutput

SAID_BYTES = 16_384
"""How much of what a program wrote is kept: its end says why it died."""


class ProgramProcess:
    """The process of a program, from its start until ``close``.

    What it writes to stderr, or to stdout if both are one, is read and its end is kept, so it can
    neither block on it nor fill a terminal; ``output`` keeps all of it.  ``options`` are those of
    ``subprocess.Popen``; ``ending_s`` is how long it may take to end by itself when its stdin is
    closed.  Raises ProgramFailedError if it cannot be started.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        *,
        output: ProgramOutput | None = None,
        ending_s: float = 0.0,
        **options: Any,
    ) -> None:
        self._name, self._said, self._output = name, b"", output
        try:
            self._process: subprocess.Popen[bytes] = subprocess.Popen(
                command,
                cwd=folder,
                env={**_own(), **cpu_dispatch.environment_of_programs(), **environment},
                stdout=subprocess.PIPE,
                bufsize=0,
                **options,
            )
        except (OSError, subprocess.SubprocessError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise self.failure(
                "NotStarted", f"{command[0]} cannot be started in {folder.name}/: {reason}"
            ) from None
        self._end = weakref.finalize(self, _end, self._process, ending_s)
        stream = self._process.stderr or self._process.stdout
        assert stream is not None
        self._saying = stream.fileno()
        os.set_blocking(self._saying, False)
        self._ready = selectors.PollSelector()
        self._ready.register(self._saying, selectors.EVENT_READ)

    def ready(self, limit_s: float | None) -> set[int]:
        """Wait for something to read, and read what it says; return the files with data."""
        found = {key.fd for key, _ in self._ready.select(limit_s)}
        if self._saying in found:
            self.read_said()
        return found

    def read_said(self) -> None:
        """Read what it says beside its link."""
        # A program that writes without end must not keep this process here.
        for _ in range(16):
            try:
                data = os.read(self._saying, 2**16)
            except BlockingIOError:
                return
            if not data:
                with contextlib.suppress(KeyError):
                    self._ready.unregister(self._saying)
                return
            self._said = (self._said + data)[-SAID_BYTES:]
            if self._output is not None:
                self._output.write(data)

    @property
    def said(self) -> str:
        """The end of what it said."""
        return self._said.decode(errors="replace").strip()

    def failure(
        self, error: str, message: str, kind: Literal["died", "nonsense"] = "died"
    ) -> ProgramFailedError:
        """Return the error for something that went wrong with the program."""
        return ProgramFailedError(
            error, f"{self._name} {message}", where=self._name, trace=self.said, kind=kind
        )

    def close(self) -> None:
        """End the process, what it has started, and what is left of its group."""
        if self._end.alive:
            self.read_said()
        self._end()


def _own() -> dict[str, str]:
    """Return this process's environment, without what differs from test to test."""
    other = ("PYTEST_", "COV_CORE_")
    return {key: value for key, value in os.environ.items() if not key.startswith(other)}


def has_ended(process: subprocess.Popen[bytes], limit_s: float) -> bool:
    """Wait until a process has ended, and leave its status; return whether it has (Linux)."""
    file = os.pidfd_open(process.pid)
    try:
        return bool(select.select([file], [], [], limit_s)[0])
    finally:
        os.close(file)


def _end(process: subprocess.Popen[bytes], ending_s: float) -> None:
    started = descendants_of(process.pid)
    if ending_s > 0:
        with contextlib.suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        has_ended(process, ending_s)
    kill(started)
    # Nobody has taken its status yet, so its group cannot be another one's by now.
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()
    for stream in (process.stdout, process.stderr):
        if stream is not None:
            stream.close()
