"""The local pool: flies on this machine, in worker processes or in this process."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

from pytest_garl import cpu_dispatch
from pytest_garl.errors import LedgerError, PoolError
from pytest_garl.execution.checkout import Checkout
from pytest_garl.execution.exit_guard import watched_flight
from pytest_garl.execution.fly_and_judge import fly_and_save
from pytest_garl.execution.job import TIMEOUT_S, parse_job
from pytest_garl.execution.judge_process import JudgeProcess
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.processes import Heartbeat, WorkerReport, create_report_file, read_report
from pytest_garl.execution.worker_failure import WorkerExit, call_limit_s, retry_or_record
from pytest_garl.process_tree import descendants_of, kill
from pytest_garl.scenarios.files import parse_scenario

SILENT_LIMITS = 3
"""For this many limits of a call a worker's supervisor may show no sign of life."""
TURN_S = 0.02
"""How long one turn of a pool waits for its workers."""
MAX_IDLE_EXITS = 3
"""If more workers than this end one after the other and nothing is flown, the pool gives up."""
LEAST_SILENCE_S = 10.0
"""A worker that shows no sign of life for less time than this is never taken for one that stands
still; it shows one four times a second, and a machine may be busy."""
STDERR_BYTES = 2**16
"""How much of a worker's stderr is read; its end says why the worker died."""


class WorkerKind(Protocol):
    """The kind of workers in a pool: what they run, and what follows if one ends."""

    @property
    def max_workers(self) -> int:
        """How many workers the ledger may have, those of other pools included."""

    @property
    def shutdown_s(self) -> float:
        """How long a worker may take to end after it was asked to."""

    def command(self, ledger: Path) -> Sequence[str]:
        """Return the module that a worker runs, and its arguments."""

    def silence_s(self, queue: WorkQueue, pid: int) -> float:
        """Return for how long a worker may show no sign of life."""

    def handle_exit(self, queue: WorkQueue, pid: int, ended: WorkerExit) -> bool:
        """Decide on the slot that a worker had claimed; return whether it had claimed one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Worker:
    process: subprocess.Popen[bytes]
    stderr: IO[bytes]
    """A file: a pipe that nobody reads would block a worker that writes much."""
    report_file: int
    heartbeat: Heartbeat

    def has_ended(self) -> bool:
        """Return whether the process has ended; if so, end the rest of its session."""
        pid = self.process.pid
        # Popen.poll frees the id, by which the rest of the session is ended.
        try:
            if not hasattr(os, "waitid"):
                # As on macOS before Python 3.13: the id is used at once.
                if self.process.poll() is None:
                    return False
            elif os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
                return False
        except ChildProcessError:
            # Somebody in this process ignores SIGCHLD, so that the kernel has buried it.
            pass
        self._end_session()
        self.process.wait()
        return True

    def request_end(self) -> None:
        """Ask the process to end; Popen.terminate would free the id of one that has ended."""
        os.kill(self.process.pid, signal.SIGTERM)

    def end(self, shutdown_s: float) -> None:
        """Wait for a process that was asked to end, then kill what is left of its session."""
        until = time.monotonic() + shutdown_s
        while time.monotonic() < until and not self.has_ended():
            time.sleep(TURN_S / 4)
        if self.process.returncode is None:
            self.end_at_once()

    def end_at_once(self) -> None:
        """Kill the process and all below it: stopped, it cannot end them itself."""
        below = descendants_of(self.process.pid)
        self._end_session()
        kill(below)
        self.process.wait()

    def _end_session(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)

    def report(self) -> WorkerReport | None:
        """Return the last report of the process, or of its supervisor."""
        return read_report(self.report_file)

    def last_stderr(self) -> str:
        """Return the end of the process's stderr."""
        size = self.stderr.seek(0, os.SEEK_END)
        self.stderr.seek(max(0, size - STDERR_BYTES))
        return self.stderr.read().decode(errors="replace")

    def close(self) -> None:
        """Close the files."""
        self.stderr.close()
        os.close(self.report_file)


class ProcessPool:
    """The workers that this process has started; several pools share a ledger and its limit."""

    in_process = False

    def __init__(self, queue: WorkQueue, kind: WorkerKind) -> None:
        self._queue, self._kind = queue, kind
        self._workers: dict[int, _Worker] = {}
        self._idle_exits = 0
        self._flown = 0.0

    def turn(self) -> None:
        """Handle the workers that have ended, start those that are missing, and wait a moment."""
        for pid, worker in list(self._workers.items()):
            if worker.has_ended():
                del self._workers[pid]
                self._handle_exit(pid, worker)
            elif stands_still := self._stands_still(pid, worker):
                del self._workers[pid]
                worker.end_at_once()
                self._handle_exit(pid, worker, stands_still)
        self._queue.release_dead()
        most = self._kind.max_workers
        while len(self._workers) < most and self._queue.register_worker(most, self._start):
            pass
        time.sleep(TURN_S)

    def close(self) -> None:
        """End the workers and give back their slots."""
        for worker in self._workers.values():
            worker.request_end()
        for pid, worker in self._workers.items():
            worker.end(self._kind.shutdown_s)
            worker.close()
            with contextlib.suppress(LedgerError):
                # If this fails, the slots are given back when the run is resumed.
                self._queue.release(pid)
                self._queue.unregister_worker(pid)
        self._workers.clear()

    def _stands_still(self, pid: int, worker: _Worker) -> str:
        """Return what took too long if a worker shows no sign of life any more; empty if it does.

        Its supervisor watches the flight, but a landing system may stop its supervisor by a signal.
        """
        silent_s = worker.heartbeat.silent_s()
        if silent_s < LEAST_SILENCE_S:
            return ""
        limit_s = max(LEAST_SILENCE_S, self._kind.silence_s(self._queue, pid))
        if silent_s < limit_s:
            return ""
        return f"the process that watches it stood still for {limit_s:g} s of wall time"

    def _start(self) -> int:
        stderr = tempfile.TemporaryFile("a+b")  # noqa: SIM115 (closed when the worker has ended)
        report_file = create_report_file()
        module, *arguments = self._kind.command(self._queue.path)
        parent = [str(os.getpid()), str(report_file)]
        process = subprocess.Popen(
            [sys.executable, "-m", module, *parent, *arguments],
            env={**os.environ, **cpu_dispatch.environment()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            pass_fds=[report_file],
            start_new_session=True,
        )
        worker = _Worker(
            process=process,
            stderr=stderr,
            report_file=report_file,
            heartbeat=Heartbeat(report_file),
        )
        self._workers[process.pid] = worker
        return process.pid

    def _handle_exit(self, pid: int, worker: _Worker, stands_still: str = "") -> None:
        """Decide what follows from the end of a worker, which may have been ended as it hung."""
        try:
            found, status = worker.report(), worker.process.wait()
            report = found or WorkerReport()
            if report.cannot_go_on:
                self._queue.release(pid)
                raise PoolError(report.cannot_go_on.strip())
            ended = WorkerExit(
                status=status if report.status is None else report.status,
                stacks=report.stacks,
                stderr=report.stderr or worker.last_stderr(),
                hung=stands_still or report.hung,
                failure=report.failure,
                watched=found is not None,
            )
            if not self._kind.handle_exit(self._queue, pid, ended):
                self._count_idle_exit(ended)
        finally:
            self._queue.unregister_worker(pid)
            worker.close()

    def _count_idle_exit(self, ended: WorkerExit) -> None:
        """Give up if worker after worker ends without a flight; one may end between two flights."""
        flown = self._queue.flights()
        if flown > self._flown:
            self._flown, self._idle_exits = flown, 0
        if ended.status != 0 or not ended.watched:
            self._idle_exits += 1
        if self._idle_exits > MAX_IDLE_EXITS:
            raise PoolError(f"worker processes end before they fly:\n{ended.stderr.strip()}")


def local_pool(queue: WorkQueue, workers: int, checkout: Checkout | None = None) -> Pool:
    """Return a pool of ``workers`` worker processes; with 0 it flies in this process.

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
    kill(descendants_of(os.getpid()) - before)


@contextlib.contextmanager
def temporary_pool(workers: int, checkout: Checkout | None = None) -> Iterator[tuple[Ledger, Pool]]:
    """Yield a temporary ledger and its pool of workers; both end with the ``with`` block.

    The workers import landing systems from ``checkout`` only, if it is given.
    """
    with tempfile.TemporaryDirectory(prefix="garl-") as scratch:
        ledger = Ledger.create(Path(scratch) / "ledger.sqlite", {})
        pool = local_pool(ledger.queue, workers, checkout)
        try:
            yield ledger, pool
        finally:
            pool.close()
            ledger.close()
