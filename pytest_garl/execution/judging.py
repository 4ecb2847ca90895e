"""Judges flights in a worker's supervisor, which never runs a line of the landing system's code."""

from __future__ import annotations

import importlib
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pytest_garl.errors import LedgerError, SimulatorError
from pytest_garl.execution.fly_and_judge import FlownJob, judge_record
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger_queue import WorkQueue
from pytest_garl.execution.processes import failure_text
from pytest_garl.foreign_text import (
    MESSAGE_CHARS,
    TRACEBACK_CHARS,
    class_name,
    text_from,
)
from pytest_garl.scenarios.files import parse_scenario

SIMULATOR = "the simulator"
"""The failed component, in the message of an error that ends the run."""
_JUDGING = (
    "execution.severity_of_flight",
    "scenarios.maps.map_file",
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

    def judge(self, request: dict[str, Any], end_flying: Callable[[], None]) -> dict[str, Any]:
        """Judge a flight; return the facts with which the worker must end, or none.

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
                # The slot was given back: whoever claims it now flies it again.
                return {}
            job, scenario = parse_job(claim.job), parse_scenario(claim.scenario)
            try:
                judged = judge_record(job, scenario, claim.flight, FlownJob(**request))
            except Exception as error:  # noqa: BLE001 (a record may hold anything)
                return _unproven(error) if proves else {"failure": failure_of(error)}
            if not proves:
                self._queue.record(claim, *judged)
                self._queue.count("idle_s", idle_s)
        except LedgerError as error:
            return {"cannot_go_on": str(error)}
        return {}


def _unproven(error: Exception) -> dict[str, Any]:
    return {"cannot_go_on": str(SimulatorError(failure_text(error, SIMULATOR)))}


def failure_of(error: Exception) -> dict[str, str]:
    """Return type, message and traceback of an error, whatever its own code does."""
    kind = class_name(type(error))
    return {
        "error": kind,
        "message": text_from(lambda: str(error), MESSAGE_CHARS, f"{kind}, whose str()"),
        "traceback": text_from(lambda: _text(error), TRACEBACK_CHARS, f"{kind}, whose traceback"),
    }


def _text(error: Exception) -> str:
    return "".join(traceback.format_exception(error))
