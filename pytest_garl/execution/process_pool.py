"""A pool of worker processes: starts them, looks after them, and ends them."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol

from pytest_garl import cpu_dispatch
from pytest_garl.errors import LedgerError, PoolError
from pytest_garl.execution.ledger_queue import WorkQueue
from pytest_garl.execution.processes import read_report, report_file
from pytest_garl.execution.worker_failure import WorkerExit

POLL_S = 0.02
MOST_LOSSES = 3
"""Children that may end, one after the other, before anything is flown: then the pool gives up."""
COMPLAINT_BYTES = 2**16
"""How much is read of what a child said on stderr: its end says why it died."""


class WorkerKind(Protocol):
    """What the children of a pool are, and what the death of one means."""

    @property
    def max_workers(self) -> int:
        """How many there may be, with those of other pools on the ledger."""

    @property
    def patience_s(self) -> float:
        """How long a child may take to end when it is asked to."""

    def command(self, ledger: Path) -> Sequence[str]:
        """Return the module that a child runs, and its arguments."""

    def handle_exit(self, queue: WorkQueue, pid: int, death: WorkerExit) -> bool:
        """Settle what a child had in flight; return whether it was flying at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Child:
    process: subprocess.Popen[bytes]
    said: IO[bytes]
    """Its stderr: a file, since a pipe that nobody reads blocks a child that says much."""
    report: int

    def has_ended(self) -> bool:
        """Return whether it has; then nothing of its session is left."""
        pid = self.process.pid
        # Not by Popen.poll: that frees the id, and what is left of the session is ended by it.
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            return False
        self._end_session()
        self.process.wait()
        return True

    def ask_to_end(self) -> None:
        """Ask it to end; Popen.terminate would free the id of one that has ended."""
        os.kill(self.process.pid, signal.SIGTERM)

    def end(self, patience_s: float) -> None:
        """See that it ends, which it was asked to, and that nothing of its session is left."""
        until = time.monotonic() + patience_s
        while time.monotonic() < until and not self.has_ended():
            time.sleep(POLL_S / 4)
        if self.process.returncode is None:
            self._end_session()
            self.process.wait()

    def _end_session(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)

    def reported(self) -> dict[str, Any]:
        """Return what it, or its supervisor, reported when it ended."""
        return read_report(self.report)

    def complaint(self) -> str:
        """Return the last it said."""
        size = self.said.seek(0, os.SEEK_END)
        self.said.seek(max(0, size - COMPLAINT_BYTES))
        return self.said.read().decode(errors="replace")

    def close(self) -> None:
        """Close its files."""
        self.said.close()
        os.close(self.report)


class ProcessPool:
    """The children of this process; several pools share a ledger and its limit of workers."""

    def __init__(self, queue: WorkQueue, crew: WorkerKind) -> None:
        self._queue, self._crew = queue, crew
        self._children: dict[int, _Child] = {}
        self._losses = 0
        self._flown = 0.0

    def turn(self) -> None:
        """Look after the children for a moment."""
        for pid, child in list(self._children.items()):
            if child.has_ended():
                del self._children[pid]
                self._handle_exit(pid, child)
        self._queue.release_dead()
        max_workers = self._crew.max_workers
        while len(self._children) < max_workers and self._queue.register_worker(
            max_workers, self._spawn
        ):
            pass
        time.sleep(POLL_S)

    def close(self) -> None:
        """End the children and give back what they had in flight."""
        for child in self._children.values():
            child.ask_to_end()
        for pid, child in self._children.items():
            child.end(self._crew.patience_s)
            child.close()
            with contextlib.suppress(LedgerError):
                # What cannot be given back is given back when the run is resumed.
                self._queue.release(pid)
                self._queue.unregister_worker(pid)
        self._children.clear()

    def _spawn(self) -> int:
        said = tempfile.TemporaryFile("a+b")  # noqa: SIM115 (closed when the child is gone)
        report = report_file()
        module, *arguments = self._crew.command(self._queue.path)
        parent = [str(os.getpid()), str(report)]
        process = subprocess.Popen(
            [sys.executable, "-m", module, *parent, *arguments],
            env={**os.environ, **cpu_dispatch.environment()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            pass_fds=[report],
            start_new_session=True,
        )
        self._children[process.pid] = _Child(process=process, said=said, report=report)
        return process.pid

    def _handle_exit(self, pid: int, child: _Child) -> None:
        """Decide what a child's end means."""
        try:
            facts, status = child.reported(), child.process.wait()
            if "cannot_go_on" in facts:
                self._queue.release(pid)
                raise PoolError(facts["cannot_go_on"].strip())
            failure = facts.get("failure")
            death = WorkerExit(
                status=facts.get("status", status),
                words=facts.get("words", ""),
                complaint=facts.get("complaint") or child.complaint(),
                hung=facts.get("hung", ""),
                failure=(failure["error"], failure["message"], failure["traceback"])
                if failure
                else None,
                watched=bool(facts),
            )
            if not self._crew.handle_exit(self._queue, pid, death):
                self._lose(death)
        finally:
            self._queue.unregister_worker(pid)
            child.close()

    def _lose(self, death: WorkerExit) -> None:
        """Give up if child after child ends without a flight; one may end between two flights."""
        flown = self._queue.flights()
        if flown > self._flown:
            self._flown, self._losses = flown, 0
        if death.status != 0 or not death.watched:
            self._losses += 1
        if self._losses > MOST_LOSSES:
            raise PoolError(f"worker processes end before they fly:\n{death.complaint.strip()}")
