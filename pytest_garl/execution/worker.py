"""A flying worker process: claim, note in flight, fly, record, until the parent is gone."""

from __future__ import annotations

import dataclasses
import traceback
from contextlib import closing
from os import _exit, getpid, getppid
from pathlib import Path
from time import monotonic, sleep

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError, LandingSystemError, LedgerError, SimulatorError
from pytest_garl.execution.checkout import isolate_imports
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.processes import Parent, run_worker
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.slot import flight_name
from pytest_garl.execution.supervisor import FlightMonitor, supervise
from pytest_garl.simulation.system_under_test.texts import (
    MESSAGE_CHARS,
    TRACEBACK_CHARS,
    name_of,
    told,
)

IDLE_S = 0.02
ALONE_FACTOR = 3.0
_TRUSTED = "pytest_garl."
"""Pilots of this package leave their process as it was."""
RESTART_S = 1.0
"""How long a child that has flown leaves a slot to a fresh one before it makes way for another."""
SIMULATOR = "the simulator"


def main(parent: Parent, path: str, *checkouts: str) -> None:
    """Fly until the parent process is gone; with checkouts, see only the first of them."""
    owner = getpid()

    def fly(monitor: FlightMonitor) -> None:
        if checkouts:
            isolate_imports(checkouts)
        Flyer(Path(path), owner, monitor).run()

    supervise(parent, fly, SIMULATOR)


class Flyer:
    """Claims, flies and records slot after slot, under the name of the supervisor ``owner``.

    It ends where a fresh process shall go on: after a flight that left something behind, and where
    another landing system is to be flown.  What one replaces in its process (``numpy.zeros``), or
    leaves to happen later, must bend the flights of no other.
    """

    def __init__(self, path: Path, owner: int, monitor: FlightMonitor) -> None:
        self._path, self._owner, self._monitor = path, owner, monitor
        self._me = getpid()
        self._system = ""
        self._idle_s = 0.0

    def run(self) -> None:
        """Fly until the supervisor is gone, or until a fresh process shall go on."""
        import cv2

        from pytest_garl.execution.process_state import ProcessState

        cv2.setNumThreads(1)
        cpu_dispatch.check()
        state = ProcessState()
        while (claim := self._next()) is not None:
            try:
                result, sha256, wall_s = self._fly(claim)
                with closing(WorkQueue.open(self._path, self._owner)) as queue:
                    queue.record(claim, result, sha256, wall_s)
                    queue.count("idle_s", self._idle_s)
            except Exception as error:
                if _cannot_go_on(error) and not state.limited():
                    raise
                self._monitor.report(failure=_described(error))
                break
            if state.changed():
                break

    def _next(self) -> Claim | None:
        """Wait for a slot and return it; None where a fresh process shall go on, or none at all.

        The ledger is closed in between: a landing system may close all files, and what is written
        to one of them then would go anywhere.
        """
        try:
            with closing(WorkQueue.open(self._path, self._owner)) as queue:
                return self._claimed(queue)
        except GarlError:
            if not self._system:
                raise
            # What flew here may be the reason; otherwise a fresh process will say the same.
            return None

    def _claimed(self, queue: WorkQueue) -> Claim | None:
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
            sleep(IDLE_S)
        return None

    def _fly(self, claim: Claim) -> tuple[FlightResult, str, float]:
        from pytest_garl.execution.flight import fly_job
        from pytest_garl.execution.job import load_scenario, loads, record_file

        job, scenario = loads(claim.job), load_scenario(claim.scenario)
        if not job.system.module.startswith(_TRUSTED):
            self._system = job.system.name
        name = flight_name(claim.search, claim.generation, claim.slot, job.map)
        limit_s = job.timeout_s * (ALONE_FACTOR if claim.after else 1.0)
        if "failed" in claim.after:
            self._prove_simulator(claim)
        try:
            record_file(job, claim).unlink(missing_ok=True)
            self._monitor.flight_begins(limit_s)
            return fly_job(job, scenario, name, self._monitor)
        except OSError as error:
            # The landing system's own are part of its flight; this one is of the record.
            raise LedgerError(f"{job.flights}: {error.strerror or error}") from error
        finally:
            if getpid() != self._me:
                # The landing system has forked: only one of the two flies on.
                _exit(0)
            self._monitor.flight_ends()

    def _prove_simulator(self, claim: Claim) -> None:
        """Fly what failed with the reference pilot; raise GarlError if that fails as well."""
        from pytest_garl.execution.flight import fly_job
        from pytest_garl.execution.job import load_scenario, loads
        from pytest_garl.execution.reference import reference_to
        from pytest_garl.simulation.system_under_test.reference_pilot import ReferencePilot

        job = dataclasses.replace(loads(claim.job), system=reference_to(ReferencePilot))
        name = flight_name(claim.search, claim.generation, claim.slot, job.map)
        try:
            fly_job(job, load_scenario(claim.scenario), name, None)
        except GarlError:
            raise
        except Exception as error:
            raise SimulatorError(
                f"{SIMULATOR} failed in a worker process:\n{_text(error)}"
            ) from error


def _cannot_go_on(error: Exception) -> bool:
    """Whether an error is none of the landing system's doing, if it left files and limits alone."""
    return isinstance(error, GarlError) and not isinstance(error, LandingSystemError)


def _described(error: Exception) -> dict[str, str]:
    kind = name_of(type(error))
    return {
        "error": kind,
        "message": told(lambda: str(error), MESSAGE_CHARS, f"{kind}, whose str()"),
        "traceback": told(lambda: _text(error), TRACEBACK_CHARS, f"{kind}, whose traceback"),
    }


def _text(error: Exception) -> str:
    return "".join(traceback.format_exception(error))


if __name__ == "__main__":
    run_worker(main, SIMULATOR)
