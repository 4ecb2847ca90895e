"""The pool: starts flying children, looks after them, and waits for slots."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError
from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.checkout import Checkout
from pytest_garl.search.child import CANNOT_GO_ON, THREADS, dump_file
from pytest_garl.search.job import broken_result, fly_job, load_scenario, loads
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.slots import Slot, flight_name

POLL_S = 0.02
MOST_LOSSES = 3
"""Children that may die without a flight before the pool gives up."""


class Pool:
    """The children of this process; several pools share a ledger and its seats.

    With a ``checkout`` they see the modules of that landing stack and of no other.
    """

    def __init__(self, ledger: Ledger, workers: int, checkout: Checkout | None = None) -> None:
        self._ledger, self._workers = ledger, workers
        self._folders = checkout.arguments if checkout else ()
        self._children: dict[int, subprocess.Popen[str]] = {}
        self._losses = 0

    def wait(self, search: str, slot: Slot, tick: Callable[[], None]) -> dict[str, Any]:
        """Return a slot's result when it is flown; ``tick`` is called before and while waiting."""
        tick()
        while (result := self._ledger.result(search, slot.generation, slot.index)) is None:
            self.turn()
            tick()
        return result

    def turn(self) -> None:
        """Let the flying go on for a moment: look after the children, or fly one slot here."""
        if self._workers == 0:
            self._fly_here()
        else:
            self._look_after()
            time.sleep(POLL_S)

    def close(self) -> None:
        """End this process's children and give back what they had in flight."""
        for pid, child in self._children.items():
            child.terminate()
            child.communicate()
            with contextlib.suppress(LedgerError):
                # What cannot be given back is given back when the run is resumed.
                self._ledger.release(pid, "waiting")
                self._ledger.leave_seat(pid)
            dump_file(self._ledger.path.parent, pid).unlink(missing_ok=True)
        self._children.clear()

    def _fly_here(self) -> None:
        claim = self._ledger.claim(lease_s=None)
        if claim is None:
            self._ledger.release_dead()
            time.sleep(POLL_S)
            return
        job = loads(claim.job)
        slot_id = flight_name(claim.search, claim.generation, claim.slot, job.map)
        result, sha256, wall_s = fly_job(job, load_scenario(claim.scenario), slot_id, None)
        self._ledger.record(claim, result, sha256, wall_s)

    def _look_after(self) -> None:
        for pid, child in list(self._children.items()):
            if child.poll() is not None:
                del self._children[pid]
                self._bury(pid, child)
        self._ledger.release_dead()
        while len(self._children) < self._workers and self._ledger.take_seat(
            self._workers, self._spawn
        ):
            pass

    def _spawn(self) -> int:
        environment = {**os.environ, **THREADS}
        child = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "pytest_garl.search.child",
                str(self._ledger.path),
                *self._folders,
            ],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self._children[child.pid] = child
        return child.pid

    def _bury(self, pid: int, child: subprocess.Popen[str]) -> None:
        """Decide what a child's death means for the slot that it had in flight."""
        try:
            self._settle(pid, child)
        finally:
            self._ledger.leave_seat(pid)

    def _settle(self, pid: int, child: subprocess.Popen[str]) -> None:
        file = dump_file(self._ledger.path.parent, pid)
        words = file.read_text() if file.exists() else ""
        file.unlink(missing_ok=True)
        complaint = child.communicate()[1]
        if CANNOT_GO_ON in complaint:
            self._ledger.release(pid, "waiting")
            raise LedgerError(complaint.partition(CANNOT_GO_ON)[2].strip())
        found = self._ledger.claim_of(pid)
        if found is None:
            self._losses += 1
            if self._losses > MOST_LOSSES:
                raise LedgerError(f"flying children die before they fly:\n{complaint.strip()}")
            return
        claim, attempts = found
        job = loads(claim.job)
        if "Traceback (most recent call last)" in complaint:
            raise LedgerError(f"the simulator failed in a child process:\n{complaint.strip()}")
        diagonal = load_map(job.map, tuple(Path(f) for f in job.map_folders)).diagonal_m
        hung = words.startswith("Timeout")
        if attempts == 1:
            # A slow machine, or its lack of memory, is no violation: once more, alone.
            self._ledger.release(pid, "hung" if hung else "died")
            self._ledger.count("retried")
            return
        if hung:
            text = f"one call took longer than {3 * job.timeout_s:g} s of wall time, twice"
            result = broken_result("hung", "Timeout", text, words, diagonal)
        else:
            status = child.returncode
            how = f"signal {-status}" if status < 0 else f"exit status {status}"
            text = f"its process ended with {how}, twice"
            result = broken_result("died", how.replace(" ", "-"), text, complaint, diagonal)
        self._ledger.record(claim, result, "", 0.0)
