"""Flights outside the searches: several procedures each request one flight at a time.

A procedure, such as the shrinking of a case, decides on each flight by the result of the one
before.  It is a plain function that calls ``fly``, in a thread of its own.  This module puts the
requested flights into the ledger, lets the pool fly them, and returns the results.
A thread never touches the ledger.  A procedure's requests depend only on its own results, so
neither the number of workers nor an interruption changes anything: a resumed run makes the same
requests and finds the results in the ledger.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from pytest_garl.execution.flight_id import CompletedFlight, FlightId, search_key
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.scenario import Scenario

T = TypeVar("T")


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
    requests: queue.SimpleQueue[tuple[FlightJob, Scenario] | None]
    results: queue.SimpleQueue[CompletedFlight | None]
    awaited: tuple[FlightId, Path] | None = None
    flown: int = 0

    def fly(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Request a flight and wait for it; the procedure calls this method as ``fly``."""
        self.requests.put((job, scenario))
        result = self.results.get()
        if result is None:
            # If a procedure catches the error and requests another flight, it is stopped again.
            self.results.put(None)
            raise _StoppedError
        return result


class OnDemandFlights:
    """Runs procedures; ``on_wait`` is called while their flights are waited for."""

    def __init__(self, ledger: Ledger, pool: Pool, on_wait: Callable[[], None]) -> None:
        self._ledger, self._pool, self._on_wait = ledger, pool, on_wait

    def run(self, functions: Mapping[str, Callable[[FlyFunction], T]]) -> dict[str, T]:
        """Return what each procedure returns; raise the first error of one.

        The names are part of the flights' keys, so that a resumed run must give the same.
        """
        procedures = [
            _Procedure(name=name, requests=queue.SimpleQueue(), results=queue.SimpleQueue())
            for name in functions
        ]
        with ThreadPoolExecutor(max(1, len(functions)), thread_name_prefix="garl") as threads:
            try:
                futures = {
                    procedure.name: _begin(threads, procedure, functions[procedure.name])
                    for procedure in procedures
                }
                self._wait(procedures)
            finally:
                for procedure in procedures:
                    procedure.results.put(None)
        return {name: future.result() for name, future in futures.items()}

    def _wait(self, procedures: Sequence[_Procedure]) -> None:
        """Let the pool fly until no procedure requests a flight."""
        waiting = list(procedures)
        while waiting:
            waiting = [procedure for procedure in waiting if not self._advance(procedure)]
            if waiting:
                self._pool.turn()
            self._on_wait()

    def _advance(self, procedure: _Procedure) -> bool:
        """Continue a procedure until it waits for a flight; return whether it has ended."""
        while True:
            if procedure.awaited is not None:
                done = self._ledger.completed(*procedure.awaited)
                if done is None:
                    return False
                procedure.awaited = None
                procedure.results.put(done)
            request = procedure.requests.get()
            if request is None:
                return True
            self._add_flight(procedure, *request)

    def _add_flight(self, procedure: _Procedure, job: FlightJob, scenario: Scenario) -> None:
        text = dump_scenario(scenario)
        # The key contains the request: a run resumed with another budget requests other flights.
        key = f"on demand {procedure.name} {procedure.flown} {job.flown_facts()} {text}"
        flight = FlightId(search=search_key(key), map=job.map)
        procedure.awaited = flight, Path(job.flights)
        procedure.flown += 1
        self._ledger.add_flight(flight, job.system.name, job.dumps(), text)


def _begin(
    threads: ThreadPoolExecutor, procedure: _Procedure, function: Callable[[FlyFunction], T]
) -> Future[T]:
    future = threads.submit(function, procedure.fly)
    future.add_done_callback(lambda _: procedure.requests.put(None))
    return future
