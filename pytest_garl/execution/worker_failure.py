"""What it means when a flying process ends in a flight: a finding, or once more alone.

The machine ends processes too: it has no memory left, or it is so slow that a call takes too long.
So a process that was killed, and a call that took too long, are flown once more, alone and with
more time, and are a finding if it happens again.  What ends a process in any other way is the
landing system, at the first time.
"""

from __future__ import annotations

import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.execution.job import broken_result, loads
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.scenarios.maps.map import load_map

ATTEMPTS = 3
"""A flight that hangs, is killed and makes the simulator fail, each once, is left undecided."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkerExit:
    """How a flying process ended: its exit status (a signal's negative), its last words.

    ``hung`` says what took too long, as the beginning of a sentence; ``words`` where that was;
    ``complaint`` is what was said on stderr; ``failure`` is the error of the simulator, with type,
    message and traceback; ``watched`` is false where its supervisor did not live to tell.
    """

    status: int
    words: str = ""
    complaint: str = ""
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


def retry_or_record(queue: WorkQueue, claim: Claim, death: WorkerExit) -> None:
    """Decide what a death means for the slot that was in flight."""
    earlier = claim.after.split()
    if death.cause == "died" or death.cause in earlier or len(earlier) + 1 == ATTEMPTS:
        again = death.cause in earlier
        undecided = death.cause != "died" and not again
        queue.record(claim, _result(claim, death, again, undecided), "", 0.0)
    else:
        queue.fly_alone(claim, " ".join([*earlier, death.cause]))
        queue.count("retried")


def _result(claim: Claim, death: WorkerExit, again: bool, undecided: bool) -> dict[str, Any]:
    job = loads(claim.job)
    diagonal = load_map(job.map, tuple(Path(folder) for folder in job.map_folders)).diagonal_m
    kind, error, message, text = _described(death)
    if undecided:
        how = f"each of {ATTEMPTS} flights ended its process in a different way"
        message = f"{how}, at last: {message}"
    elif again:
        message += ", twice"
    return broken_result(kind, error, message, text, diagonal, inconclusive=undecided)


def _described(death: WorkerExit) -> tuple[str, str, str, str]:
    """Return kind, error, message and text of what ended a flight."""
    if death.hung:
        return "hung", "Timeout", death.hung, death.words
    if death.failure:
        error, message, text = death.failure
        message = f"the simulator, which flies the reference pilot, failed with {error}: {message}"
        return "broke", error, message, text
    how = f"signal {-death.status}" if death.status < 0 else f"exit status {death.status}"
    return "died", how.replace(" ", "-"), f"its process ended with {how}", death.complaint
