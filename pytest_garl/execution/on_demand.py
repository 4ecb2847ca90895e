"""Flights outside the searches: several procedures each request one flight at a time.

A procedure, such as the shrinking of a case, decides on each flight by the result of the one
before.  It is a plain function that calls ``fly``, in a thread of its own.  This module puts the
requested flights into the ledger, lets the pool fly them, and returns the results.
A thread never touches the ledger.  A procedure's requests depend only on its own results, so
neither the number of workers nor an interruption changes anything: a resumed run makes the same
requests and finds the results in the ledger.
"""

from __future__ import annotations

import dataclasses
import json
import queue
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar

from pytest_garl.errors import LedgerError
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot, search_key
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.scenario import Scenario

T = TypeVar("T")
PATIENCE_S = 0.01
"""How long the next request of a procedure is waited for.  Most take a millisecond; planning an
escape takes seconds, in which the flights of the others go on."""


class FlyFunction(Protocol):
    """Flies a scenario as a job says, and waits for it."""

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Return the flight with its result."""


class _StoppedError(BaseException):
    """Ends the thread of a procedure whose result is not needed any more."""


@dataclass(slots=True, kw_only=True)
class _Procedure:
    """A running procedure; None in a queue ends its requests, or its wait for a result."""

    name: str
    requests: queue.SimpleQueue[tuple[FlightJob, Scenario] | None] = field(
        default_factory=queue.SimpleQueue
    )
    results: queue.SimpleQueue[CompletedFlight | None] = field(default_factory=queue.SimpleQueue)
    awaited: tuple[FlightId, Path] | None = None
    requested: int = 0
    thread: threading.Thread | None = None

    def fly(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Request a flight and wait for it; the procedure calls this method as ``fly``."""
        self.requests.put((job, scenario))
        result = self.results.get()
        if result is None:
            # If a procedure catches the error and requests another flight, it is stopped again.
            self.results.put(None)
            raise _StoppedError
        return result

    def start(self, function: Callable[[FlyFunction], T]) -> Future[T]:
        """Run a function in a thread, and return what it will return."""
        future: Future[T] = Future()

        def work() -> None:
            try:
                future.set_result(function(self.fly))
            except BaseException as error:  # noqa: BLE001 (whoever asks for the result raises it)
                future.set_exception(error)
            finally:
                self.requests.put(None)

        self.thread = threading.Thread(target=work, name=f"garl {self.name}", daemon=True)
        self.thread.start()
        return future

    def stop(self) -> None:
        """End the thread when it requests its next flight."""
        self.results.put(None)


class OnDemandFlights:
    """Runs procedures, all at once or one after the other; ``on_wait`` is called at each turn.

    ``priority`` returns the priority of a flight by the procedure's name and the number of its
    earlier flights; those of a higher one fly earlier.
    """

    def __init__(
        self,
        ledger: Ledger,
        pool: Pool,
        on_wait: Callable[[], None] = lambda: None,
        *,
        priority: Callable[[str, int], int] = lambda name, requested: 0,
    ) -> None:
        self._ledger, self._pool, self._on_wait = ledger, pool, on_wait
        self._priority = priority
        self._procedures: dict[str, _Procedure] = {}
        self.flown = 0
        """How many flights the procedures were given."""
        # In this process a flight and a procedure must not compute at the same time.
        self._patience_s = None if pool.in_process else PATIENCE_S

    def start(self, name: str, function: Callable[[FlyFunction], T]) -> Future[T]:
        """Start a procedure; return what it will return.

        The name is part of its flights' keys, so that a resumed run must give the same.
        """
        procedure = self._procedures[name] = _Procedure(name=name)
        return procedure.start(function)

    def advance(self) -> None:
        """Give the procedures the flights that have ended, and request the next ones."""
        for name, procedure in list(self._procedures.items()):
            if self._has_ended(procedure):
                del self._procedures[name]

    def turn(self) -> None:
        """Go on with the procedures, and let the pool fly for a moment if one still runs."""
        self.advance()
        if self._procedures:
            self._pool.turn()

    def requested(self, name: str) -> int:
        """Return how many flights a procedure that runs has requested."""
        procedure = self._procedures.get(name)
        return procedure.requested if procedure else 0

    def close(self) -> None:
        """End the procedures that still run, and wait for their threads."""
        for procedure in self._procedures.values():
            procedure.stop()
        for procedure in self._procedures.values():
            # A signal may come before the thread has started.
            if procedure.thread is not None and procedure.thread.is_alive():
                procedure.thread.join()
        self._procedures.clear()

    def run(self, functions: Mapping[str, Callable[[FlyFunction], T]]) -> dict[str, T]:
        """Return what each procedure returns; raise the first error of one."""
        try:
            futures = {name: self.start(name, function) for name, function in functions.items()}
            while self._procedures:
                self.turn()
                self._on_wait()
        finally:
            self.close()
        return {name: future.result() for name, future in futures.items()}

    def _has_ended(self, procedure: _Procedure) -> bool:
        """Continue a procedure until it waits for a flight; return whether it has ended."""
        while True:
            if procedure.awaited is not None:
                done = self._ledger.completed(*procedure.awaited)
                if done is None:
                    return False
                procedure.awaited = None
                procedure.results.put(done)
                self.flown += 1
            try:
                request = procedure.requests.get(timeout=self._patience_s)
            except queue.Empty:
                return False
            if request is None:
                return True
            self._add_flight(procedure, *request)

    def _add_flight(self, procedure: _Procedure, job: FlightJob, scenario: Scenario) -> None:
        text = dump_scenario(scenario)
        # The key contains the request: a run resumed with another budget requests other flights.
        key = f"on demand {procedure.name} {procedure.requested} {job.flown_facts()} {text}"
        flight = FlightId(search=search_key(key), map=job.map)
        procedure.awaited = flight, Path(job.flights)
        priority = self._priority(procedure.name, procedure.requested)
        procedure.requested += 1
        self._ledger.add_flight(flight, job.system.name, job.dumps(), text, priority=priority)


def fly_all(
    ledger: Ledger,
    pool: Pool,
    job: FlightJob,
    scenarios: Sequence[Scenario],
    on_wait: Callable[[], None] = lambda: None,
) -> Iterator[CompletedFlight]:
    """Yield the flight of each scenario, in order; the pool flies them at the same time.

    Raises LedgerError if the ledger has the same scenarios with another job.
    """
    system = job.system.name
    texts = {index: dump_scenario(scenario) for index, scenario in enumerate(scenarios)}
    identity = [system, job.map, job.npcs.name, dataclasses.asdict(job.limits), *texts.values()]
    search = search_key(json.dumps(identity))
    ledger.add_search(search, system, job.map, len(texts), job.dumps(), kind="case")
    recorded = ledger.job(search)
    differing = job.differences(parse_job(recorded)) if recorded else ()
    if differing:
        raise LedgerError(
            f"{ledger.path}: {system} on {job.map} flew the same scenarios before, but "
            f"{', '.join(differing)} changed; run without --garl-resume to start over"
        )
    ledger.add_slots(search, 0, texts)
    for index in texts:
        flight = FlightId(search=search, map=job.map, slot=Slot(generation=0, index=index))
        yield wait_for(ledger, pool, flight, Path(job.flights), on_wait)
