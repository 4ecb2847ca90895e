"""What it means when a flying process ends in a flight: a finding, or once more alone.

The machine ends processes too: it has no memory left, or it is so slow that a call takes too long.
So a process that was killed, and a call that took too long, are flown once more, alone and with
more time, and are a finding if it happens again.  What ends a process in any other way is the
landing system, at the first time.
"""

from __future__ import annotations

import signal
from dataclasses import dataclass, replace
from pathlib import Path

from pytest_garl.execution.job import loads
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.result import FlightResult, broken_result
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.simulation.flight import Crash

ATTEMPTS = 3
"""A flight that hangs, is killed and makes the simulator fail, each once, is left undecided."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerExit:
    """How a flying process ended: its exit status (a signal's negative), its last stacks.

    ``hung`` says what took too long, as the beginning of a sentence; ``stacks`` where that was;
    ``stderr`` is what was said on stderr; ``failure`` is the error of the simulator, with type,
    message and traceback; ``watched`` is false where its supervisor did not live to tell.
    """

    status: int
    stacks: str = ""
    stderr: str = ""
    hung: str = ""
    failure: tuple[str, str, str] | None = None
    watched: bool = True

    @property
    def cause(self) -> str:
        """One of "hung", "failed", "killed" and "died"; the last is the landing system's doing."""
        if self.hung:
            return "hung"
        if self.failure:
            return "failed"
        return "killed" if self.status == -signal.SIGKILL or not self.watched else "died"


def retry_or_record(queue: WorkQueue, claim: Claim, ended: WorkerExit) -> None:
    """Decide what a ended means for the slot that was in flight."""
    earlier = claim.after.split()
    if ended.cause == "died" or ended.cause in earlier or len(earlier) + 1 == ATTEMPTS:
        again = ended.cause in earlier
        undecided = ended.cause != "died" and not again
        queue.record(claim, _result(claim, ended, again, undecided), "", 0.0)
    else:
        queue.fly_alone(claim, " ".join([*earlier, ended.cause]))
        queue.count("retried")


def _result(claim: Claim, ended: WorkerExit, again: bool, undecided: bool) -> FlightResult:
    job = loads(claim.job)
    diagonal = load_map(job.map, tuple(Path(folder) for folder in job.map_folders)).diagonal_m
    crash = _crash(ended)
    if undecided:
        how = f"each of {ATTEMPTS} flights ended its process in a different way"
        crash = replace(crash, message=f"{how}, at last: {crash.message}")
    elif again:
        crash = replace(crash, message=f"{crash.message}, twice")
    return broken_result(crash, diagonal, inconclusive=undecided)


def _crash(ended: WorkerExit) -> Crash:
    """Return what ended a flight."""
    if ended.hung:
        return Crash(
            kind="hung", error="Timeout", message=ended.hung, where="", traceback=ended.stacks
        )
    if ended.failure:
        error, message, text = ended.failure
        message = f"the simulator, which flies the reference pilot, failed with {error}: {message}"
        return Crash(kind="broke", error=error, message=message, where="", traceback=text)
    how = f"signal {-ended.status}" if ended.status < 0 else f"exit status {ended.status}"
    return Crash(
        kind="died",
        error=how.replace(" ", "-"),
        message=f"its process ended with {how}",
        where="",
        traceback=ended.stderr,
    )
