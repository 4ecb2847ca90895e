"""The actor that flies single slots on a node of a Ray cluster, in a worker process of its own."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from pytest_garl import cpu_dispatch
from pytest_garl.engine import packages
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.local_pool import FlightWorkers, ProcessPool
from pytest_garl.execution.pool import wait_for
from pytest_garl.execution.reference import Reference, package_sha256
from pytest_garl.execution.result import FlightResult, broken_result
from pytest_garl.execution.worker_failure import WorkerExit
from pytest_garl.files.json_values import parse_json
from pytest_garl.flight.flight import Crash, version_of

_PLACEHOLDER_RESULT = broken_result(Crash(kind="died", error="", message=""), diagonal_m=0.0)
"""The entry in the actor's own ledger for a flight whose worker ended; nothing reads it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathMapping:
    """Two folders with the same project: ``local`` where pytest runs, ``remote`` on this node."""

    local: str
    remote: str

    def remote_job(self, text: str) -> FlightJob:
        """Return the job in ``text`` with the paths of this node.

        Ray copies only the project.  Landing systems and simulators from outside it are imported
        by their module's name, from where this node has them installed.
        """
        job = parse_job(
            _replace_folder(text, _json_escaped(self.local), _json_escaped(self.remote))
        )
        return dataclasses.replace(
            job,
            system=self._importable_here(job.system),
            simulator=self._importable_here(job.simulator),
        )

    def to_local(self, text: str) -> str:
        """Return a text, such as a traceback, with the paths of the machine where pytest runs."""
        return _replace_folder(text, self.remote, self.local)

    def _importable_here(self, reference: Reference) -> Reference:
        """Leave out the file of a reference from outside the project."""
        if reference.file.startswith(f"{self.remote}/"):
            return reference
        return dataclasses.replace(reference, file="")


def _json_escaped(path: str) -> str:
    return json.dumps(path)[1:-1]


def _replace_folder(text: str, old: str, new: str) -> str:
    """Replace a folder if it is a whole path or the beginning of one."""
    return re.sub(rf"(?<![\w.-]){re.escape(old)}(?![^/\"'\s])", lambda _: new, text)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightOutput:
    """The output of a flight: the values for the ledger, and the bytes of its record."""

    result: FlightResult
    sha256: str
    wall_s: float
    record: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorWorkspace:
    """The folders of actors; each has one of its own below ``scratch``.

    ``project`` is the project's folder where pytest runs.  If it is set, Ray has copied the project
    into the actor's working directory, and removes that in the end.  ``working_dir`` is the folder
    in which pytest runs, below the project.
    """

    scratch: str = "."
    project: str = ""
    working_dir: str = "."


class FlightActor:
    """Flies one slot after the other.

    It uses a local pool with one worker and its own ledger.  So a landing system that dies or
    hangs ends only that worker, and its exit is described as on the local pool.  The caller
    decides whether the slot is flown again.
    """

    def __init__(self, workspace: ActorWorkspace) -> None:
        here, project = Path.cwd(), workspace.project
        self._paths = PathMapping(local=project, remote=str(here)) if project else None
        self._folder = Path(tempfile.mkdtemp(prefix=".garl-actor-", dir=here / workspace.scratch))
        os.chdir(here / workspace.working_dir)
        self._ledger = Ledger.create(self._folder / "ledger.sqlite", {})
        self._pool = ProcessPool(
            self._ledger.queue, FlightWorkers(max_workers=1, on_exit=self._note_exit)
        )
        self._flight_count = 0
        self._worker_exit: WorkerExit | None = None

    def node_and_versions(self) -> tuple[str, dict[str, str]]:
        """Return the node's name, and the versions that the bytes of a flight depend on."""
        return platform.node(), versions()

    def fly(self, claim: Claim) -> FlightOutput | WorkerExit:
        """Fly a slot once; return its output, or how its worker ended."""
        self._flight_count += 1
        job = dataclasses.replace(self._job(claim.job), flights=str(self._folder / "flights"))
        flight = FlightId(search=str(self._flight_count), map=job.map)
        self._ledger.add_flight(
            flight, job.system.name, job.dumps(), claim.scenario, claim.earlier_exits
        )
        completed = wait_for(self._ledger, self._pool, flight, Path(job.flights), lambda: None)
        if self._worker_exit is not None:
            ended, self._worker_exit = self._worker_exit, None
            error, message, traceback = ended.failure or ("", "", "")
            return dataclasses.replace(
                ended,
                stacks=self._to_local(ended.stacks),
                stderr=self._to_local(ended.stderr),
                failure=(error, self._to_local(message), self._to_local(traceback))
                if error
                else None,
            )
        record = job.record(flight).read_bytes()
        job.record(flight).unlink()
        return FlightOutput(
            result=FlightResult.from_json(parse_json(self._to_local(completed.result.dumps()))),
            sha256=completed.sha256,
            wall_s=self._ledger.queries.flying_s(flight.search),
            record=record,
        )

    def close(self) -> None:
        """End the worker and remove the folder."""
        self._pool.close()
        self._ledger.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _job(self, text: str) -> FlightJob:
        return self._paths.remote_job(text) if self._paths else parse_job(text)

    def _to_local(self, text: str) -> str:
        return self._paths.to_local(text) if self._paths else text

    def _note_exit(self, queue: WorkQueue, claim: Claim, ended: WorkerExit) -> None:
        """Keep the exit, and mark the slot as flown, so that this actor flies it once."""
        self._worker_exit = ended
        queue.record(claim, _PLACEHOLDER_RESULT, "", 0.0)


def versions() -> dict[str, str]:
    """Return the versions of all code that the bytes of a flight depend on."""
    return {
        "sources of pytest-garl": package_sha256()[:12],
        "CPU dispatch": cpu_dispatch.expected(),
        **{name: version_of(name) for name in packages()},
    }
