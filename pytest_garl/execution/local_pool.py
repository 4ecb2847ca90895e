"""The local pool: flies on this machine, in worker processes or in this process."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl import cpu_dispatch
from pytest_garl.execution.checkout import Checkout
from pytest_garl.execution.exit_guard import watched_flight
from pytest_garl.execution.fly_and_judge import fly_and_save
from pytest_garl.execution.job import TIMEOUT_S, parse_job
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.process_pool import TURN_S, ProcessPool
from pytest_garl.execution.processes import descendants_of
from pytest_garl.execution.worker_failure import WorkerExit, call_limit_s, retry_or_record
from pytest_garl.scenarios.files import parse_scenario

SILENT_LIMITS = 3
"""For so many limits of a call a worker's supervisor may show no sign of life."""


def local_pool(queue: WorkQueue, workers: int, checkout: Checkout | None = None) -> Pool:
    """Return a pool of so many worker processes; with 0 it flies in this process.

    If this process would compute other bytes than a worker, 0 means one worker.  With a
    ``checkout`` the workers import the landing system from that folder alone.
    """
    if workers == 0 and cpu_dispatch.pin():
        return InProcessPool(queue)
    folders = checkout.arguments if checkout else ()
    return ProcessPool(queue, FlightWorkers(max_workers=max(1, workers), folders=folders))


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightWorkers:
    """Workers that claim, fly and record slot after slot."""

    max_workers: int
    folders: tuple[str, ...] = ()
    shutdown_s: float = 3.0
    on_exit: Callable[[WorkQueue, Claim, WorkerExit], None] = retry_or_record
    """Decides what the exit of a worker means for the slot that it flew."""

    def command(self, ledger: Path) -> Sequence[str]:
        """Return the module that a worker runs, and its arguments."""
        return ["pytest_garl.execution.worker", str(ledger), *self.folders]

    def silence_s(self, queue: WorkQueue, pid: int) -> float:
        """Return for how long a worker may show no sign of life: three limits of a call."""
        claim = queue.claim_of(pid)
        if claim is None:
            return SILENT_LIMITS * TIMEOUT_S
        return SILENT_LIMITS * call_limit_s(parse_job(claim.job), claim)

    def handle_exit(self, queue: WorkQueue, pid: int, ended: WorkerExit) -> bool:
        """Decide on the slot that a worker had claimed; return whether it had claimed one."""
        claim = queue.claim_of(pid)
        if claim is None:
            return False
        self.on_exit(queue, claim, ended)
        return True


class InProcessPool:
    """Flies one slot after the other in this process, for a debugger; another one judges."""

    in_process = True

    def __init__(self, queue: WorkQueue) -> None:
        self._queue = queue
        self._judge = JudgeProcess()

    def turn(self) -> None:
        """Fly one slot."""
        claim = self._queue.claim(lease_s=None)
        if claim is None:
            self._queue.release_dead()
            time.sleep(TURN_S)
            return
        job, scenario = parse_job(claim.job), parse_scenario(claim.scenario)
        self._judge.start()
        before = descendants_of(os.getpid())
        with watched_flight() as watch:
            flown = fly_and_save(job, scenario, claim.flight, None)
        with self._queue.when_locked(lambda: _end_those_since(before)):
            if watch.status is None:
                self._queue.record(claim, *self._judge.judge(job, scenario, claim.flight, flown))
                return
            # As if a worker had ended: the same finding, and no record.
            job.record(claim.flight).unlink(missing_ok=True)
            retry_or_record(self._queue, claim, WorkerExit(status=watch.status, stderr=watch.stack))

    def close(self) -> None:
        """End the process that judges; no flight is under way between two turns."""
        self._judge.close()


def _end_those_since(before: set[int]) -> None:
    """End the processes that a flight has left below this one: one of them holds the lock."""
    for pid in descendants_of(os.getpid()) - before:
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)
