"""Decides after a worker ended during a flight: a violation, or a second flight.

A busy machine may also end a worker: memory runs out, or a call takes too long.  So if a worker was
killed or a call took too long, the slot is flown once more, with no other flight beside it and with
a longer limit.  If the same happens again, it is a violation.  If a worker ends in any other way,
the landing system ended it, and that is a violation at once.
"""

from __future__ import annotations

import signal
from dataclasses import dataclass, replace

from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.result import FlightResult, broken_result
from pytest_garl.flight.flight import Crash

RETRY_LIMIT_FACTOR = 3.0
"""A flight that is repeated alone gets this many times the limit of a call."""
ATTEMPTS = 3
"""If a slot hangs, is killed and makes the simulator fail, once each, it stays inconclusive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerExit:
    """How a worker ended.

    ``status`` is the exit status of the flying process, negative for a signal.  ``hung`` says what
    took too long, as the beginning of a sentence, and ``stacks`` are the stacks of that moment.
    ``stderr`` is the end of its stderr.  ``failure`` is the type, message and traceback of an error
    of the simulator.  ``watched`` is false if the supervisor ended without a report.
    """

    status: int
    stacks: str = ""
    stderr: str = ""
    hung: str = ""
    failure: tuple[str, str, str] | None = None
    watched: bool = True

    @property
    def cause(self) -> str:
        """One of "hung", "failed", "killed" and "died"; only the landing system causes the last."""
        if self.hung:
            return "hung"
        if self.failure:
            return "failed"
        return "killed" if self.status == -signal.SIGKILL or not self.watched else "died"


def call_limit_s(job: FlightJob, claim: Claim) -> float:
    """Return how long one call of the landing system may take in this attempt, in seconds."""
    return job.timeout_s * (RETRY_LIMIT_FACTOR if claim.earlier_exits else 1.0)


def retry_or_record(queue: WorkQueue, claim: Claim, ended: WorkerExit) -> None:
    """Hand a worker's slot out once more, or record a violation or an inconclusive flight."""
    earlier = claim.earlier_exits.split()
    if ended.cause == "died" or ended.cause in earlier or len(earlier) + 1 == ATTEMPTS:
        repeated = ended.cause in earlier
        inconclusive = ended.cause != "died" and not repeated
        queue.record(claim, _result(claim, ended, repeated, inconclusive), "", 0.0)
    else:
        queue.fly_alone(claim, " ".join([*earlier, ended.cause]))
        queue.count("retried")


def _result(claim: Claim, ended: WorkerExit, repeated: bool, inconclusive: bool) -> FlightResult:
    job = parse_job(claim.job)
    diagonal = job.load_map().diagonal_m
    crash = _crash(ended)
    if inconclusive:
        how = f"each of {ATTEMPTS} flights ended its process in a different way"
        crash = replace(crash, message=f"{how}, at last: {crash.message}")
    elif repeated:
        crash = replace(crash, message=f"{crash.message}, twice")
    return broken_result(crash, diagonal, inconclusive=inconclusive)


def _crash(ended: WorkerExit) -> Crash:
    """Return the exit as the crash of a flight."""
    if ended.hung:
        said = f"{ended.stderr.strip()}\n{ended.stacks}".lstrip()
        return Crash(kind="hung", error="Timeout", message=ended.hung, traceback=said)
    if ended.failure:
        error, message, text = ended.failure
        if error != LandingSystemError.__name__:
            message = (
                f"the simulator, which flies the reference pilot, failed with {error}: {message}"
            )
        return Crash(kind="broke", error=error, message=message, traceback=text)
    how = f"signal {-ended.status}" if ended.status < 0 else f"exit status {ended.status}"
    return Crash(
        kind="died",
        error=how.replace(" ", "-"),
        message=f"its process ended with {how}",
        traceback=ended.stderr,
    )
