"""Flights beside the searches: several procedures ask for one flight at a time.

A procedure, such as the shrinking of a case, decides on each flight by the result of the one
before.  It is a plain function that calls ``fly``, in a thread of its own.  This module puts the
flights that procedures ask for into the ledger, lets the pool fly them, and returns the results.
A thread never touches the ledger.  A procedure's questions depend on its own results alone, so
that neither the number of workers nor an interruption changes anything: a resumed run asks the
same questions and finds the answers in the ledger.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from pytest_garl.execution.flight_id import FlightId, search_key
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.result import CompletedFlight
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
    """One procedure under way; None in a queue ends its questions, or the wait for an answer."""

    name: str
    asked: queue.SimpleQueue[tuple[FlightJob, Scenario] | None]
    answers: queue.SimpleQueue[CompletedFlight | None]
    awaited: tuple[FlightId, Path] | None = None
    flown: int = 0

    def fly(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Ask for a flight and wait for it; the procedure calls this method as ``fly``."""
        self.asked.put((job, scenario))
        answer = self.answers.get()
        if answer is None:
            # A procedure that catches the error and asks again is ended again.
            self.answers.put(None)
            raise _StoppedError
        return answer


class OnDemandFlights:
    """Runs procedures; ``on_wait`` is called while their flights are waited for."""

    def __init__(self, ledger: Ledger, pool: Pool, on_wait: Callable[[], None]) -> None:
        self._ledger, self._pool, self._on_wait = ledger, pool, on_wait

    def run(self, functions: Mapping[str, Callable[[FlyFunction], T]]) -> dict[str, T]:
        """Return what each procedure returns; raise the first error of one.

        The names are part of the flights' keys, so that a resumed run must give the same.
        """
        procedures = [
            _Procedure(name=name, asked=queue.SimpleQueue(), answers=queue.SimpleQueue())
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
                    procedure.answers.put(None)
        return {name: future.result() for name, future in futures.items()}

    def _wait(self, procedures: Sequence[_Procedure]) -> None:
        """Let the pool fly until no procedure asks any more."""
        waiting = list(procedures)
        while waiting:
            waiting = [procedure for procedure in waiting if not self._advance(procedure)]
            if waiting:
                self._pool.turn()
            self._on_wait()

    def _advance(self, procedure: _Procedure) -> bool:
        """Take a procedure as far as it goes without a new flight; return whether it has ended."""
        while True:
            if procedure.awaited is not None:
                done = self._ledger.completed(*procedure.awaited)
                if done is None:
                    return False
                procedure.awaited = None
                procedure.answers.put(done)
            wanted = procedure.asked.get()
            if wanted is None:
                return True
            self._ask(procedure, *wanted)

    def _ask(self, procedure: _Procedure, job: FlightJob, scenario: Scenario) -> None:
        text = dump_scenario(scenario)
        # The key holds the question: a run resumed with another budget asks other questions.
        key = f"on demand {procedure.name} {procedure.flown} {job.flown_facts()} {text}"
        flight = FlightId(search=search_key(key), map=job.map)
        procedure.awaited = flight, Path(job.flights)
        procedure.flown += 1
        self._ledger.add_flight(flight, job.system.name, job.dumps(), text)


def _begin(
    threads: ThreadPoolExecutor, procedure: _Procedure, function: Callable[[FlyFunction], T]
) -> Future[T]:
    future = threads.submit(function, procedure.fly)
    future.add_done_callback(lambda _: procedure.asked.put(None))
    return future
