"""A worker: claims a slot, flies it and has it judged, until its parent process ends.

The worker's supervisor judges, and never runs a line of the landing system's code.
"""

from __future__ import annotations

import ctypes
import dataclasses
import gc
import importlib
import traceback
from collections.abc import Callable
from contextlib import closing
from os import _exit, getpid, getppid
from pathlib import Path
from resource import getpagesize
from time import monotonic, sleep
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError, LandingSystemError, LedgerError, SimulatorError
from pytest_garl.execution.checkout import isolate_imports
from pytest_garl.execution.fly_and_judge import FlownJob, judge_record
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.processes import Parent, WorkerReport, failure_text, run_worker
from pytest_garl.execution.supervisor import FlightMonitor, supervise
from pytest_garl.execution.worker_failure import call_limit_s
from pytest_garl.foreign_text import (
    MESSAGE_CHARS,
    TRACEBACK_CHARS,
    class_name,
    text_from,
)
from pytest_garl.scenarios.files import parse_scenario

CLAIM_EVERY_S = 0.02
"""Time between two attempts to claim a slot."""
_TRUSTED = "pytest_garl."
"""Landing systems of this package leave their process as it was."""
MOST_KEPT_BYTES = 300 * 2**20
"""A process that holds more between two flights gives freed pages back."""
_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)
"""Only glibc has it."""
RESTART_S = 1.0
"""How long a used worker waits for a fresh one to take a slot, before it ends to make room."""
SIMULATOR = "the simulator"
"""The failed component, in the message of an error that ends the run."""
_JUDGING = (
    "execution.severity_of_flight",
    "scenarios.maps.loading",
    "flight.flight_file",
    "verdicts.judge",
)


def import_what_judges() -> None:
    """Import the modules that judge, so that a process which is forked later has them too."""
    for name in _JUDGING:
        importlib.import_module(f"pytest_garl.{name}")


class SlotJudge:
    """Judges the slot that a worker has claimed, and records the result in the ledger.

    Job, scenario and limits come from the ledger; the flying process only says that it has flown.
    ``worker`` is the process id under which the slot is claimed.
    """

    def __init__(self, ledger: Path, worker: int) -> None:
        self._ledger, self._worker = ledger, worker
        self._queue: WorkQueue | None = None

    def judge(self, request: dict[str, Any], end_flying: Callable[[], None]) -> WorkerReport | None:
        """Judge a flight; return the report with which the worker must end, or None.

        ``end_flying`` ends the flying process: called if the ledger is locked, since a thread that
        the flight has left may hold the lock.
        A record that cannot be judged is a failure of the flight, as an error of the simulator is.
        ``request`` holds the fields of a FlownJob.  With ``proves`` the flight is one of the
        reference pilot, of which only counts that it can be judged.
        """
        proves, idle_s = request.pop("proves", False), request.pop("idle_s", 0.0)
        try:
            if self._queue is None:
                self._queue = WorkQueue.open(self._ledger, self._worker, end_flying)
            claim = self._queue.claim_of(self._worker)
            if claim is None:
                # The slot was given back: the worker that claims it now flies it again.
                return None
            job, scenario = parse_job(claim.job), parse_scenario(claim.scenario)
            try:
                judged = judge_record(job, scenario, claim.flight, FlownJob(**request))
            except Exception as error:  # noqa: BLE001 (a record may hold anything)
                return _unproven(error) if proves else _failure(error)
            if not proves:
                self._queue.record(claim, *judged)
                self._queue.count("idle_s", idle_s)
        except LedgerError as error:
            return WorkerReport(cannot_go_on=str(error))
        return None


def _unproven(error: Exception) -> WorkerReport:
    return WorkerReport(cannot_go_on=str(SimulatorError(failure_text(error, SIMULATOR))))


def _failure(error: Exception) -> WorkerReport:
    """Report type, message and traceback of an error, whatever its own code does."""
    kind = class_name(type(error))
    message = text_from(lambda: str(error), MESSAGE_CHARS, f"{kind}, whose str()")
    text = text_from(lambda: _text(error), TRACEBACK_CHARS, f"{kind}, whose traceback")
    return WorkerReport(failure=(kind, message, text))


def _text(error: Exception) -> str:
    return "".join(traceback.format_exception(error))


def main(parent: Parent, path: str, *checkouts: str) -> None:
    """Fly until the parent process ends; with checkouts, import from the first of them alone."""
    owner = getpid()

    def fly(monitor: FlightMonitor) -> None:
        if checkouts:
            isolate_imports(checkouts)
        Worker(Path(path), owner, monitor).run()

    # Before the fork: the flying process would import them too.
    import_what_judges()
    supervise(parent, fly, SlotJudge(Path(path), owner).judge, SIMULATOR)


class Worker:
    """Claims and flies slot after slot, and has its supervisor judge them.

    Slots are claimed for ``owner``, the process id of the supervisor.
    It ends if a fresh process must continue: after a flight that changed the process, and before
    another landing system flies.  If a landing system replaces ``numpy.zeros`` or leaves a thread
    behind, no other system's flights may change.
    """

    def __init__(self, path: Path, owner: int, monitor: FlightMonitor) -> None:
        self._path, self._owner, self._monitor = path, owner, monitor
        self._me = getpid()
        self._system = ""
        self._idle_s = 0.0

    def run(self) -> None:
        """Fly until the supervisor ends, or until a fresh process must continue."""
        # The supervisor needs none of these modules: it has forked this process before.
        import cv2

        from pytest_garl.execution.process_state import ProcessState

        cv2.setNumThreads(1)
        cpu_dispatch.check()
        state = ProcessState()
        # What is there by now stays, so that to collect what a flight leaves takes milliseconds.
        gc.freeze()
        while (claim := self._wait_for_slot()) is not None:
            try:
                flown = self._fly(claim)
            except Exception as error:
                if _is_permanent(error) and not state.limited():
                    raise
                self._monitor.report(_failure(error))
                break
            goes_on = self._monitor.request(**dataclasses.asdict(flown), idle_s=self._idle_s)
            if not goes_on or state.changed():
                break

    def _wait_for_slot(self) -> Claim | None:
        """Wait for a slot and return it; None if this process must end.

        The ledger is closed during a flight: a landing system may close all files and open others,
        and a write to the ledger would then go into one of those.
        """
        try:
            with closing(WorkQueue.open(self._path, self._owner)) as queue:
                return self._claim(queue)
        except Exception:
            if not self._system:
                raise
            # The landing system may be the reason, whatever the error: it may have replaced
            # sqlite3.connect. If it is not, a fresh process meets the same error.
            return None

    def _claim(self, queue: WorkQueue) -> Claim | None:
        idle_since = monotonic()
        while getppid() == self._owner:
            claim = queue.claim(flown=self._system)
            self._idle_s = monotonic() - idle_since
            if claim is not None:
                return claim
            if self._system and queue.others_wait(self._system):
                break
            if self._system and self._idle_s > RESTART_S and queue.alone_waits():
                break
            sleep(CLAIM_EVERY_S)
        return None

    def _fly(self, claim: Claim) -> FlownJob:
        from pytest_garl.execution.fly_and_judge import fly_and_save
        from pytest_garl.execution.job import parse_job
        from pytest_garl.scenarios.files import parse_scenario

        job, scenario = parse_job(claim.job), parse_scenario(claim.scenario)
        if not job.system.module.startswith(_TRUSTED):
            self._system = job.system.name
        limit_s = call_limit_s(job, claim)
        if "failed" in claim.earlier_exits:
            self._prove_simulator(claim)
        try:
            self._monitor.flight_begins(limit_s)
            flown = fly_and_save(job, scenario, claim.flight, self._monitor)
            give_back_memory()
            return flown
        except OSError as error:
            # Errors of the landing system are part of its flight; this one is of the record.
            raise LedgerError(f"{job.flights}: {error.strerror or error}") from error
        finally:
            if getpid() != self._me:
                # The landing system has forked: the copy must not continue the flight.
                _exit(0)
            self._monitor.flight_ends()

    def _prove_simulator(self, claim: Claim) -> None:
        """Fly the scenario with the reference pilot; raise GarlError if that fails too."""
        from pytest_garl.execution.fly_and_judge import fly_and_save
        from pytest_garl.execution.job import parse_job
        from pytest_garl.execution.reference import reference_to
        from pytest_garl.scenarios.files import parse_scenario
        from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

        job = dataclasses.replace(
            parse_job(claim.job), system=reference_to(ReferencePilot), takeover=None
        )
        try:
            flown = fly_and_save(job, parse_scenario(claim.scenario), claim.flight, None)
        except GarlError:
            raise
        except Exception as error:
            raise SimulatorError(failure_text(error, SIMULATOR)) from error
        self._monitor.request(**dataclasses.asdict(flown), proves=True)


def give_back_memory() -> None:
    """Free what a flight has left in cycles; if much is kept, give freed pages to the system.

    A flight's pictures lie in cycles, its own or those of the landing system, which Python would
    collect some flights later.  The C library keeps freed pages between those in use, and the
    next flight uses them: to get them anew takes 3 % of a flight, so most flights leave them.
    """
    gc.collect()
    if _TRIM is not None and _resident_bytes() > MOST_KEPT_BYTES:
        _TRIM(0)


def _resident_bytes() -> int:
    """Return the memory of this process, 0 if the system does not say."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * getpagesize()
    except OSError:
        return 0


def _is_permanent(error: Exception) -> bool:
    """Whether an error occurs in any process: one of pytest-garl, not of the landing system."""
    return isinstance(error, GarlError) and not isinstance(error, LandingSystemError)


if __name__ == "__main__":
    run_worker(main, SIMULATOR)
