"""A pilot: flies single slots on whatever machine it is put, in a worker process of its own."""

from __future__ import annotations

import dataclasses
import os
import platform
import shutil
import tempfile
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pytest_garl import cpu_dispatch
from pytest_garl.execution.job import FlightJob, loads
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.local_pool import FlightWorkers
from pytest_garl.execution.pool import wait_for
from pytest_garl.execution.process_pool import ProcessPool
from pytest_garl.execution.ray.path_mapping import Relocation
from pytest_garl.execution.reference import package_sha256
from pytest_garl.execution.result import FlightResult, broken_result
from pytest_garl.execution.slot import Slot, flight_name
from pytest_garl.execution.worker_failure import WorkerExit
from pytest_garl.files.json_values import parse_json
from pytest_garl.simulation.flight import PACKAGES, Crash

_FIRST = Slot(generation=0, index=0)
_NO_RESULT = broken_result(
    Crash(kind="died", error="", message="", where="", traceback=""), diagonal_m=0.0
)
"""Stands in the private ledger for a flight whose process ended; nobody reads it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightOutput:
    """A flight that was flown: what the ledger records of it, and the bytes of its record."""

    result: FlightResult
    sha256: str
    wall_s: float
    record: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorWorkspace:
    """Where pilots work, each in a folder of its own below ``scratch``.

    Where ``home`` is set, Ray has put a copy of it into the working directory, in which pilots
    leave nothing that Ray does not remove with it; ``inside`` is the folder in which pytest runs.
    """

    scratch: str = "."
    home: str = ""
    inside: str = "."


class FlightActor:
    """Flies what it is told, one slot after the other.

    The flying is done by a local pool of one child with a ledger of its own, so that a landing
    system that dies or hangs takes nothing else with it, and its ended reads as it does locally.
    What it means is decided by who asked.
    """

    def __init__(self, base: ActorWorkspace) -> None:
        here = Path.cwd()
        self._relocation = Relocation(home=base.home, here=str(here)) if base.home else None
        self._folder = Path(tempfile.mkdtemp(prefix=".garl-pilot-", dir=here / base.scratch))
        os.chdir(here / base.inside)
        self._ledger = Ledger.create(self._folder / "ledger.sqlite", {})
        self._pool = ProcessPool(
            self._ledger.queue, FlightWorkers(max_workers=1, on_exit=self._note)
        )
        self._flown = 0
        self._ended: WorkerExit | None = None

    def about(self) -> tuple[str, dict[str, str]]:
        """Return the machine's name, and the versions of what decides on a flight's bytes."""
        return platform.node(), versions()

    def fly(self, claim: Claim) -> FlightOutput | WorkerExit:
        """Fly a slot once; return what it came to, or how its process ended."""
        self._flown += 1
        search, flights = str(self._flown), self._folder / "flights"
        job = dataclasses.replace(self._job(claim.job), flights=str(flights))
        self._ledger.add_search(search, job.system.name, job.map, 1, job.dumps(), "on_demand")
        self._ledger.add_slots(search, 0, {0: claim.scenario}, claim.after)
        result = wait_for(self._ledger, self._pool, search, _FIRST, lambda: None)
        if self._ended is not None:
            ended, self._ended = self._ended, None
            error, message, text = ended.failure or ("", "", "")
            return dataclasses.replace(
                ended,
                stacks=self._at_home(ended.stacks),
                stderr=self._at_home(ended.stderr),
                failure=(error, self._at_home(message), self._at_home(text)) if error else None,
            )
        file = flights / f"{flight_name(search, 0, 0, job.map)}.npz"
        record = file.read_bytes()
        file.unlink()
        return FlightOutput(
            result=FlightResult.from_json(parse_json(self._at_home(result.dumps()))),
            sha256=self._ledger.sha256(search, 0, 0),
            wall_s=self._ledger.wall_s(search, 0, 0),
            record=record,
        )

    def close(self) -> None:
        """End the child and leave nothing behind."""
        self._pool.close()
        self._ledger.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _job(self, text: str) -> FlightJob:
        return self._relocation.job(text) if self._relocation else loads(text)

    def _at_home(self, text: str) -> str:
        return self._relocation.to_local(text) if self._relocation else text

    def _note(self, queue: WorkQueue, claim: Claim, ended: WorkerExit) -> None:
        """Remember a ended and take the slot out of the queue: it is flown once."""
        self._ended = ended
        queue.record(claim, _NO_RESULT, "", 0.0)


def versions() -> dict[str, str]:
    """Return the installed versions of what decides on a flight's bytes, and our sources' hash."""
    found = {
        "sources of pytest-garl": package_sha256()[:12],
        "CPU dispatch": cpu_dispatch.expected(),
    }
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found
