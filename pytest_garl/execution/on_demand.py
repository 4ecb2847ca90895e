"""Flights beside the searches: asked for one at a time by several trains of thought at once.

Confirming and shrinking decide on each flight by what the one before came to.  Each such train of
thought is a plain function in a thread of its own that calls ``fly``; this module gathers what they
ask for, puts it into the ledger, lets the pool fly it and hands the results back.  A thread never
touches the ledger.  What a function asks for depends on its own results alone, so that neither the
number of workers nor an interruption changes anything: a resumed run asks the same again and finds
it flown.
"""

from __future__ import annotations

import hashlib
import queue
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from pytest_garl.execution.job import Job, dump_scenario
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.slot import flight_name
from pytest_garl.scenarios.scenario import Scenario

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """A flight that was asked for: its result, its trajectory's hash, where its record is."""

    result: FlightResult
    sha256: str
    record: Path

    @property
    def signature(self) -> str:
        """The violation's signature, empty for a flight without violation."""
        return self.result.signature


class Fly(Protocol):
    """Flies a scenario as a job says, and waits for it."""

    def __call__(self, job: Job, scenario: Scenario) -> Done:
        """Return what the flight came to."""


class _StoppedError(BaseException):
    """Ends a thread whose results nobody waits for any more."""


@dataclass(slots=True, kw_only=True)
class _Thought:
    """One function under way; None ends its questions, or the wait for an answer."""

    name: str
    asked: queue.SimpleQueue[tuple[Job, Scenario] | None]
    answers: queue.SimpleQueue[Done | None]
    job: Job | None = None
    search: str = ""
    flown: int = 0

    def fly(self, job: Job, scenario: Scenario) -> Done:
        """Ask for a flight and wait for it: what the function is given."""
        self.asked.put((job, scenario))
        answer = self.answers.get()
        if answer is None:
            # Whoever asks on is to be ended again.
            self.answers.put(None)
            raise _StoppedError
        return answer


class Errands:
    """Runs functions that fly; ``tick`` is called while their flights are waited for."""

    def __init__(self, ledger: Ledger, pool: Pool, tick: Callable[[], None]) -> None:
        self._ledger, self._pool, self._tick = ledger, pool, tick

    def run(self, functions: Mapping[str, Callable[[Fly], T]]) -> dict[str, T]:
        """Return what each function returns; raise the first one's error.

        The names tell flights of different functions apart and must be the same when resumed.
        """
        thoughts = [
            _Thought(name=name, asked=queue.SimpleQueue(), answers=queue.SimpleQueue())
            for name in functions
        ]
        with ThreadPoolExecutor(max(1, len(functions)), thread_name_prefix="garl") as threads:
            try:
                futures = {
                    thought.name: _begin(threads, thought, functions[thought.name])
                    for thought in thoughts
                }
                self._wait(thoughts)
            finally:
                for thought in thoughts:
                    thought.answers.put(None)
        return {name: future.result() for name, future in futures.items()}

    def _wait(self, thoughts: Sequence[_Thought]) -> None:
        """Let the pool fly what is asked for until nobody asks any more."""
        waiting = list(thoughts)
        while waiting:
            waiting = [thought for thought in waiting if not self._advance(thought)]
            if waiting:
                self._pool.turn()
            self._tick()

    def _advance(self, thought: _Thought) -> bool:
        """Take a function as far as it goes without a flight; return whether it is done."""
        while True:
            if thought.job is not None:
                done = self._done(thought.job, thought.search)
                if done is None:
                    return False
                thought.job = None
                thought.answers.put(done)
            wanted = thought.asked.get()
            if wanted is None:
                return True
            self._ask(thought, *wanted)

    def _ask(self, thought: _Thought, job: Job, scenario: Scenario) -> None:
        text = dump_scenario(scenario)
        # What is asked belongs to the key: resumed with another budget, a function asks otherwise.
        key = f"errand {thought.name} {thought.flown} {job.flown_facts()} {text}"
        thought.job, thought.search = job, hashlib.sha256(key.encode()).hexdigest()[:16]
        thought.flown += 1
        name = job.system.name
        self._ledger.add_search(thought.search, name, job.map, 1, job.dumps(), "on_demand")
        self._ledger.add_slots(thought.search, 0, {0: text})

    def _done(self, job: Job, search: str) -> Done | None:
        result = self._ledger.result(search, 0, 0)
        if result is None:
            return None
        return Done(
            result=result,
            sha256=self._ledger.sha256(search, 0, 0),
            record=Path(job.flights) / f"{flight_name(search, 0, 0, job.map)}.npz",
        )


def _begin(
    threads: ThreadPoolExecutor, thought: _Thought, function: Callable[[Fly], T]
) -> Future[T]:
    future = threads.submit(function, thought.fly)
    future.add_done_callback(lambda _: thought.asked.put(None))
    return future
