"""A pool of child processes: starts them, looks after them, and ends them."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

from pytest_garl import dispatch
from pytest_garl.errors import LedgerError, PoolError
from pytest_garl.search.child import dump_file
from pytest_garl.search.deaths import Death
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.processes import CANNOT_GO_ON

POLL_S = 0.02
MOST_LOSSES = 3
"""Children that may die without a flight before the pool gives up."""
PATIENCE_S = 30.0
"""How long a child may take to end when it is asked to; one that ends a Ray cluster needs a second
or two, and more on a busy machine."""
COMPLAINT_BYTES = 2**16
"""How much is read of what a child said on stderr: its end says why it died."""


class Crew(Protocol):
    """What the children of a pool are, and what the death of one means."""

    @property
    def seats(self) -> int:
        """How many there may be, with those of other pools on the ledger."""

    def command(self, ledger: Path) -> Sequence[str]:
        """Return the module that a child runs, and its arguments."""

    def bury(self, ledger: Ledger, pid: int, death: Death) -> bool:
        """Settle what a child had in flight; return whether it was flying at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Child:
    process: subprocess.Popen[bytes]
    said: IO[bytes]
    """Its stderr: a file, since a pipe that nobody reads blocks a child that says much."""

    def end(self) -> None:
        """End it, gently if it lets itself."""
        self.process.terminate()
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.said.close()

    def complaint(self) -> str:
        """Return the last it said."""
        size = self.said.seek(0, os.SEEK_END)
        self.said.seek(max(0, size - COMPLAINT_BYTES))
        text = self.said.read().decode(errors="replace")
        self.said.close()
        return text


class ChildPool:
    """The children of this process; several pools share a ledger and its seats."""

    def __init__(self, ledger: Ledger, crew: Crew) -> None:
        self._ledger, self._crew = ledger, crew
        self._children: dict[int, _Child] = {}
        self._losses = 0

    def turn(self) -> None:
        """Look after the children for a moment."""
        for pid, child in list(self._children.items()):
            if child.process.poll() is not None:
                del self._children[pid]
                self._bury(pid, child)
        self._ledger.release_dead()
        seats = self._crew.seats
        while len(self._children) < seats and self._ledger.take_seat(seats, self._spawn):
            pass
        time.sleep(POLL_S)

    def close(self) -> None:
        """End the children and give back what they had in flight."""
        for pid, child in self._children.items():
            child.end()
            with contextlib.suppress(LedgerError):
                # What cannot be given back is given back when the run is resumed.
                self._ledger.release(pid)
                self._ledger.leave_seat(pid)
            dump_file(self._ledger.path.parent, pid).unlink(missing_ok=True)
        self._children.clear()

    def _spawn(self) -> int:
        said = tempfile.TemporaryFile("a+b")  # noqa: SIM115 (closed when the child is gone)
        process = subprocess.Popen(
            [sys.executable, "-m", *self._crew.command(self._ledger.path)],
            env={**os.environ, **dispatch.environment()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,
        )
        self._children[process.pid] = _Child(process=process, said=said)
        return process.pid

    def _bury(self, pid: int, child: _Child) -> None:
        """Decide what a child's death means."""
        try:
            file = dump_file(self._ledger.path.parent, pid)
            words = file.read_text() if file.exists() else ""
            file.unlink(missing_ok=True)
            status = child.process.returncode
            death = Death(status=status, words=words, complaint=child.complaint())
            self._settle(pid, death)
        finally:
            self._ledger.leave_seat(pid)

    def _settle(self, pid: int, death: Death) -> None:
        if CANNOT_GO_ON in death.complaint:
            self._ledger.release(pid)
            raise PoolError(death.complaint.partition(CANNOT_GO_ON)[2].strip())
        if self._crew.bury(self._ledger, pid, death):
            return
        self._losses += 1
        if self._losses > MOST_LOSSES:
            raise PoolError(f"flying children die before they fly:\n{death.complaint.strip()}")
