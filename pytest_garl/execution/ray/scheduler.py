"""Pilots on a Ray cluster: given slots of a ledger to fly, and their flights recorded."""

from __future__ import annotations

import contextlib
import os
import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

from pytest_garl.errors import LedgerError, PoolError
from pytest_garl.execution.job import loads, record_file
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.ray.actor import ActorWorkspace, FlightActor, FlightOutput, versions
from pytest_garl.execution.worker import IDLE_S
from pytest_garl.execution.worker_failure import WorkerExit, retry_or_record

MOST_LOSSES = 3
"""Workers of Ray that may be lost with the same slot, or one after the other before they fly."""
PARTING_S = 2.0


class RayScheduler:
    """Pilots on a connected cluster, never more than ``size`` nor than there is to fly.

    ``ray`` is the module, which a process that does not fly by it shall not have to import.
    """

    def __init__(self, ray: Any, queue: WorkQueue, base: ActorWorkspace, size: int) -> None:
        self._ray, self._queue, self._base, self._size = ray, queue, base, size
        # One CPU is one flight: it flies on one thread.
        self._hire = ray.remote(num_cpus=1)(FlightActor)
        self._arriving: dict[Any, Any] = {}
        """Pilots by what will tell about them."""
        self._flying: dict[Any, tuple[Any, Claim]] = {}
        """Pilots and what they fly by what will come of it."""
        self._idle: list[tuple[Any, float, str]] = []
        """Pilots, since when they wait, and the landing system that each flew last."""
        self._lost: Counter[tuple[str, int, int]] = Counter()
        self._lost_on_arrival = 0

    def turn(self) -> None:
        """Hand out slots, and take in what was flown.

        Raises PoolError where the cluster cannot fly, LedgerError where it cannot be recorded.
        """
        self._grow()
        self._hand_out()
        pending = [*self._arriving, *self._flying]
        if not pending:
            time.sleep(IDLE_S)
            return
        ready, _ = self._ray.wait(pending, timeout=IDLE_S)
        for ref in ready:
            if ref in self._arriving:
                self._greet(ref, self._arriving.pop(ref))
            else:
                self._take_in(ref, *self._flying.pop(ref))

    def close(self) -> None:
        """Let the pilots that do not fly leave nothing behind; the others end with the cluster."""
        leaving = [pilot.close.remote() for pilot, *_ in self._idle]
        with contextlib.suppress(self._ray.exceptions.RayError):
            self._ray.get(leaving, timeout=PARTING_S)

    def _grow(self) -> None:
        """Hire pilots while there is more to fly than pilots who could."""
        free = len(self._arriving) + len(self._idle)
        room = self._size - free - len(self._flying)
        for _ in range(min(room, self._queue.waiting() - free)):
            pilot = self._hire.remote(self._base)
            self._arriving[pilot.about.remote()] = pilot

    def _greet(self, ref: Any, pilot: Any) -> None:
        """Take in a pilot that would fly the same as here."""
        try:
            node, theirs = self._ray.get(ref)
        except self._ray.exceptions.RayError as error:
            self._lost_on_arrival += 1
            if self._lost_on_arrival > MOST_LOSSES:
                raise PoolError(
                    f"workers of Ray die before they fly: {error}\nEvery node needs the same "
                    "pytest-garl as here, and what the landing system needs"
                ) from error
            return
        differing = unlike(versions(), theirs)
        if differing:
            raise PoolError(
                f"Ray's node {node} would not fly the same: it has {differing}. Install the same "
                "versions on every node, of CPUs that all have AVX2 or all lack it"
            )
        self._lost_on_arrival = 0
        self._rest(pilot)

    def _rest(self, pilot: Any, flown: str = "") -> None:
        self._idle.append((pilot, time.monotonic(), flown))

    def _hand_out(self) -> None:
        while self._idle:
            pilot, since, flown = self._idle[-1]
            # A pilot's child flies one landing system; for another it starts anew.
            claim = self._queue.claim(flown=flown) or self._queue.claim()
            if claim is None:
                return
            self._idle.pop()
            self._queue.count("idle_s", time.monotonic() - since)
            record_file(loads(claim.job), claim).unlink(missing_ok=True)
            self._flying[pilot.fly.remote(claim)] = pilot, claim

    def _take_in(self, ref: Any, pilot: Any, claim: Claim) -> None:
        try:
            flight: FlightOutput | WorkerExit = self._ray.get(ref)
        except self._ray.exceptions.RayTaskError as error:
            raise PoolError(f"on a node of Ray: {error.cause}") from error
        except self._ray.exceptions.RayError as error:
            self._lose(claim, error)
            return
        if isinstance(flight, WorkerExit):
            retry_or_record(self._queue, claim, flight)
        else:
            _keep(flight, claim)
            self._queue.record(claim, flight.result, flight.sha256, flight.wall_s)
        self._rest(pilot, loads(claim.job).system.name)

    def _lose(self, claim: Claim, error: Exception) -> None:
        """Give back a slot whose pilot is gone: Ray's worker was killed, or its node is lost.

        The landing system flies in a child of the worker, so that this is none of its doing.
        """
        slot = claim.search, claim.generation, claim.slot
        self._lost[slot] += 1
        if self._lost[slot] > MOST_LOSSES:
            times = self._lost[slot]
            raise PoolError(f"Ray lost the worker that flew the same slot {times} times: {error}")
        self._queue.give_back(claim)


def unlike(ours: Mapping[str, str], theirs: Mapping[str, str]) -> str:
    """Return in words what is installed in another version there than here."""
    return ", ".join(
        f"{name} {theirs.get(name, 'missing')} (here {version})"
        for name, version in ours.items()
        if theirs.get(name) != version
    )


def _keep(flight: FlightOutput, claim: Claim) -> None:
    """Write a flight's record where the job wants it, whole or not at all."""
    path = record_file(loads(claim.job), claim)
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_bytes(flight.record)
        scratch.replace(path)
    except OSError as error:
        raise LedgerError(f"{path.parent}: {error.strerror or error}") from error
