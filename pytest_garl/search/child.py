"""A flying child process: claim, note in flight, fly, record, until the parent is gone."""

from __future__ import annotations

import faulthandler
import os
import threading
import time
from pathlib import Path
from typing import TextIO

from pytest_garl import dispatch
from pytest_garl.errors import LedgerError
from pytest_garl.search.checkout import see_only
from pytest_garl.search.ledger import Ledger
from pytest_garl.search.processes import end_with_parent, run_child
from pytest_garl.search.slots import flight_name

IDLE_S = 0.02
BEAT_S = 5.0
ALONE_FACTOR = 3.0
_STDERR = 2


class Watchdog:
    """Ends the process when a call of the landing system takes too long.

    faulthandler's timer is a C thread: it works while the system holds the interpreter.  To start
    one takes as long as three calls of a flight control, so a timer that has just been started
    serves the calls after it too, and lets them take up to a twentieth longer than the limit.
    """

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._renew_at = 0.0
        self.limit_s = 10.0

    def step_begins(self) -> None:
        """See that the timer runs."""
        now = time.monotonic()
        if now >= self._renew_at:
            slack_s = self.limit_s / 20
            faulthandler.dump_traceback_later(self.limit_s + slack_s, exit=True, file=self._file)
            self._renew_at = now + slack_s

    def step_ends(self) -> None:
        """Let it run on: the next call renews it, ``flight_ends`` stops it."""

    def flight_ends(self) -> None:
        """Stop the timer."""
        faulthandler.cancel_dump_traceback_later()
        self._renew_at = 0.0


def dump_file(folder: Path, pid: int) -> Path:
    """Where a child leaves its last words."""
    return folder / f"child-{pid}.txt"


def keep_claims(path: Path) -> None:
    """Renew this process's claims from a thread, until the process ends."""

    def beat() -> None:
        ledger = Ledger(path)
        while True:
            time.sleep(BEAT_S)
            ledger.renew()

    threading.Thread(target=beat, daemon=True).start()


def main(path: str, *checkouts: str) -> None:
    """Fly until the parent process is gone; with checkouts, see only the first of them."""
    parent_lives = end_with_parent()
    if checkouts:
        see_only(checkouts)
    import cv2

    from pytest_garl.search.job import broken_result, fly_job, load_scenario, loads

    cv2.setNumThreads(1)
    dispatch.check()
    ledger = Ledger(Path(path))
    keep_claims(Path(path))
    idle_since = time.monotonic()
    with dump_file(Path(path).parent, os.getpid()).open("w") as words:
        watchdog = Watchdog(words)
        while parent_lives():
            claim = ledger.claim()
            if claim is None:
                time.sleep(IDLE_S)
                continue
            ledger.count("idle_s", time.monotonic() - idle_since)
            # What was said in earlier flights explains nothing about this one's death.
            os.ftruncate(_STDERR, 0)
            job = loads(claim.job)
            watchdog.limit_s = job.timeout_s * (ALONE_FACTOR if claim.after else 1.0)
            slot_id = flight_name(claim.search, claim.generation, claim.slot, job.map)
            try:
                result, sha256, wall_s = fly_job(
                    job, load_scenario(claim.scenario), slot_id, watchdog
                )
            except OSError as error:
                # The landing system's own are part of its flight; this one is of the record.
                raise LedgerError(f"{job.flights}: {error.strerror or error}") from error
            finally:
                watchdog.flight_ends()
            if claim.after == "hung":
                # It hung once and not again: the machine's doing as likely as the system's.
                text = f"one call took longer than {job.timeout_s:g} s once, but not again"
                distance = float(result["final_distance_m"])
                result = broken_result("hung", "Timeout", text, "", distance, inconclusive=True)
            ledger.record(claim, result, sha256, wall_s)
            idle_since = time.monotonic()


if __name__ == "__main__":
    run_child(main, "the simulator")
