"""The scheduler: hands a ledger's slots to actors on a Ray cluster, and records their flights."""

from __future__ import annotations

import contextlib
import os
import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

from pytest_garl.errors import LedgerError, PoolError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger_queue import Claim, WorkQueue
from pytest_garl.execution.ray.actor import ActorWorkspace, FlightActor, FlightOutput, versions
from pytest_garl.execution.worker_failure import WorkerExit, retry_or_record

WAIT_S = 0.02
"""How long one turn waits for actors."""
MAX_LOST_ACTORS = 3
"""If more actors than this are lost with the same slot, or one after the other before they fly, the
run ends."""
SHUTDOWN_S = 2.0
"""How long idle actors may take to clean up in the end."""


class RayScheduler:
    """Has actors on a connected cluster fly the slots of a queue.

    There are never more actors than ``size``, nor more than slots.  ``ray`` is the module: it is
    passed so that only a process that uses Ray imports it.
    """

    def __init__(self, ray: Any, queue: WorkQueue, workspace: ActorWorkspace, size: int) -> None:
        self._ray, self._queue, self._workspace, self._size = ray, queue, workspace, size
        # A flight runs on one thread, so it needs one CPU.
        self._actor_class = ray.remote(num_cpus=1)(FlightActor)
        self._starting: dict[Any, Any] = {}
        """Actors that start, by the reference of their node and versions."""
        self._flying: dict[Any, tuple[Any, Claim]] = {}
        """Actors that fly and their claims, by the reference of the output."""
        self._idle: list[tuple[Any, float, str]] = []
        """Actors without a slot, the time since then, and the landing system each flew last."""
        self._lost_with_slot: Counter[FlightId] = Counter()
        self._lost_at_start = 0

    def turn(self) -> None:
        """Hand out slots and record finished flights.

        Raises PoolError if the cluster cannot fly, and LedgerError if a flight cannot be recorded.
        """
        self._start_actors()
        self._hand_out()
        pending = [*self._starting, *self._flying]
        if not pending:
            time.sleep(WAIT_S)
            return
        ready, _ = self._ray.wait(pending, timeout=WAIT_S)
        for ref in ready:
            if ref in self._starting:
                self._check_versions(ref, self._starting.pop(ref))
            else:
                self._record(ref, *self._flying.pop(ref))

    def close(self) -> None:
        """Have idle actors remove their folders; the others end with the cluster."""
        closing = [actor.close.remote() for actor, *_ in self._idle]
        with contextlib.suppress(self._ray.exceptions.RayError):
            self._ray.get(closing, timeout=SHUTDOWN_S)

    def _start_actors(self) -> None:
        """Start an actor for each slot that waits without one."""
        free = len(self._starting) + len(self._idle)
        room = self._size - free - len(self._flying)
        for _ in range(min(room, self._queue.waiting() - free)):
            self._start_actor()

    def _start_actor(self) -> None:
        actor = self._actor_class.remote(self._workspace)
        self._starting[actor.node_and_versions.remote()] = actor

    def _check_versions(self, ref: Any, actor: Any) -> None:
        """Give slots to an actor that has started if it would fly the same bytes as here."""
        try:
            node, theirs = self._ray.get(ref)
        except self._ray.exceptions.RayError as error:
            self._lost_at_start += 1
            if self._lost_at_start > MAX_LOST_ACTORS:
                raise PoolError(
                    f"workers of Ray end before they fly: {error}\nEvery node needs the same "
                    "pytest-garl as here, and what the landing system needs"
                ) from error
            return
        differing = different_versions(versions(), theirs)
        if differing:
            raise PoolError(
                f"Ray's node {node} would not fly the same: it has {differing}. Install the same "
                "versions on every node, of CPUs that all have AVX2 or all lack it"
            )
        self._lost_at_start = 0
        self._add_idle(actor)

    def _add_idle(self, actor: Any, flown: str = "") -> None:
        self._idle.append((actor, time.monotonic(), flown))

    def _hand_out(self) -> None:
        while self._idle:
            actor, since, flown = self._idle[-1]
            # The worker of an actor flies one landing system; another one needs a new worker.
            claim = self._queue.claim(flown=flown) or self._queue.claim()
            if claim is None:
                return
            self._idle.pop()
            self._queue.count("idle_s", time.monotonic() - since)
            parse_job(claim.job).record(claim.flight).unlink(missing_ok=True)
            self._flying[actor.fly.remote(claim)] = actor, claim

    def _record(self, ref: Any, actor: Any, claim: Claim) -> None:
        try:
            found: FlightOutput | WorkerExit = self._ray.get(ref)
        except self._ray.exceptions.RayTaskError as error:
            raise PoolError(f"on a node of Ray: {error.cause}") from error
        except self._ray.exceptions.RayError as error:
            self._give_back(claim, error)
            return
        if isinstance(found, WorkerExit):
            retry_or_record(self._queue, claim, found)
        else:
            _write_record(found, claim)
            self._queue.record(claim, found.result, found.sha256, found.wall_s)
        self._add_idle(actor, parse_job(claim.job).system.name)

    def _give_back(self, claim: Claim, error: Exception) -> None:
        """Give back the slot of a lost actor: Ray's worker was killed, or its node is lost.

        The landing system flies in a process below Ray's worker, so it did not end the actor.
        """
        self._lost_with_slot[claim.flight] += 1
        times = self._lost_with_slot[claim.flight]
        if times > MAX_LOST_ACTORS:
            raise PoolError(f"Ray lost the worker that flew the same slot {times} times: {error}")
        self._queue.give_back(claim)


def different_versions(ours: Mapping[str, str], theirs: Mapping[str, str]) -> str:
    """Return which packages have another version there than here, as text."""
    return ", ".join(
        f"{name} {theirs.get(name, 'missing')} (here {version})"
        for name, version in ours.items()
        if theirs.get(name) != version
    )


def _write_record(flight: FlightOutput, claim: Claim) -> None:
    """Write a flight's record into the job's folder, whole or not at all."""
    path = parse_job(claim.job).record(claim.flight)
    scratch = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_bytes(flight.record)
        scratch.replace(path)
    except OSError as error:
        raise LedgerError(f"{path.parent}: {error.strerror or error}") from error
