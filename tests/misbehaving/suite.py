"""Flies all misbehaving landing systems through the pool, each followed by a well-behaved one.

``python -m tests.misbehaving.suite [NAME ...]`` prints what each came to.
"""

from __future__ import annotations

import dataclasses
import inspect
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.reference import BUILT_IN
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.process_tree import any_command_contains
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Limits
from tests.execution.flying import LAWN, job_of, scenario
from tests.misbehaving import crashes, hangs, patches, processes, values
from tests.misbehaving.base import Misbehaves, NeighbourLander

PATIENCE_S = 900.0
"""A run that waits longer for one flight hangs: two attempts of a process that stands still take
some minutes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What one misbehaving system came to, and what is wrong with that; nothing if all is well."""

    name: str
    expected: str
    came_to: str
    problem: str


def systems(names: Sequence[str] = ()) -> list[type]:
    """Return the misbehaving systems, all of them or those of these names."""
    found = [
        item
        for module in (values, crashes, hangs, processes, patches)
        for item in vars(module).values()
        if inspect.isclass(item)
        and item.__module__ == module.__name__
        and hasattr(item, "reset")
        and getattr(item, "misbehave", None) is not Misbehaves.misbehave
        and hasattr(item, "step")
    ]
    return [item for item in found if not names or item.__name__ in names]


def fly_suite(
    chosen: Sequence[type], folder: Path, tell: Callable[[Row], None] = lambda row: None
) -> list[Row]:
    """Fly each and then its neighbour, by one worker, in as few runs as possible."""
    calm = scenario().without(*(name for name, _ in LAWN.present_objects))
    rows: list[Row] = []
    waiting = list(chosen)
    while waiting:
        try:
            with _run(folder) as run:
                undisturbed = run.hash_of_neighbour(calm)
                while waiting:
                    rows.append(_row(run, waiting[0], calm, undisturbed))
                    del waiting[0]
                    tell(rows[-1])
        except (GarlError, TimeoutError) as error:
            ended = waiting.pop(0)
            text = f"ends the run: {type(error).__name__}: {str(error)[-400:]}"
            rows.append(Row(name=ended.__name__, expected="", came_to="", problem=text))
            tell(rows[-1])
    return rows


def _row(run: _Run, system: type, calm: Scenario, undisturbed: str) -> Row:
    timeout_s = 1.0 if system.__module__ == hangs.__name__ else 10.0
    done = run.fly(system, calm, timeout_s)
    kind = done.result.verdict.violation_type
    came_to = done.signature if kind else done.result.outcome
    expected = getattr(system, "comes_to", "finding")
    problem = ""
    if expected == "finding" and kind != "V":
        problem = "is no finding"
    if expected == "harmless" and done.result.outcome != "landed":
        problem = "did not land"
    if done.result.inconclusive:
        problem = "was not decided"
    beside = run.hash_of_neighbour(calm)
    if beside != undisturbed:
        problem = f"{problem} bends its neighbour: {beside}".strip()
    return Row(
        name=system.__name__, expected=expected, came_to=came_to or "no violation", problem=problem
    )


class _Run:
    """A ledger and a pool of one worker, as in a search."""

    def __init__(self, ledger: Ledger, pool: Pool, folder: Path) -> None:
        self._ledger, self._pool, self._folder = ledger, pool, folder
        self._flown = 0

    def fly(self, system: type, scenario: Scenario, timeout_s: float = 10.0) -> CompletedFlight:
        """Fly once; raise TimeoutError where the run hangs."""
        self._flown += 1
        until = time.monotonic() + PATIENCE_S

        def tick() -> None:
            if time.monotonic() > until:
                raise TimeoutError(f"no result of {system.__name__} after {PATIENCE_S:g} s")

        # Limits of their own make a search of their own, in which the same is flown again.
        limits = Limits(distance_m=100.0 + self._flown)
        job = dataclasses.replace(
            job_of(system, self._folder / "flights", timeout_s),
            simulator=BUILT_IN,
            npcs=policy_spec("stationary"),
            limits=limits,
        )
        return next(fly_all(self._ledger, self._pool, job, [scenario], tick))

    def hash_of_neighbour(self, scenario: Scenario) -> str:
        """Return the hash of the well-behaved system's flight, or what it came to instead."""
        done = self.fly(NeighbourLander, scenario)
        return done.sha256 if done.result.outcome == "landed" else str(done.result)[:300]


@contextmanager
def _run(folder: Path) -> Iterator[_Run]:
    with temporary_pool(1) as (ledger, pool):
        yield _Run(ledger, pool, folder)


def left_running() -> bool:
    """Return whether a process of a misbehaving system lives on."""
    return any_command_contains(processes.LONG_S)


def main(names: Sequence[str]) -> None:
    """Print a line for each, and a summary."""
    import tempfile

    def tell(row: Row) -> None:
        sys.stdout.write(f"{row.name:34} {row.came_to[:60]:60} {row.problem}\n")
        sys.stdout.flush()

    with tempfile.TemporaryDirectory() as folder:
        rows = fly_suite(systems(names), Path(folder), tell)
    counts: Counter[Any] = Counter(
        "finding" if row.came_to.startswith("V:") else row.came_to for row in rows
    )
    wrong = sum(bool(row.problem) for row in rows)
    sys.stdout.write(f"{len(rows)} flown: {dict(counts)}; {wrong} with a problem; ")
    sys.stdout.write(f"processes left: {left_running()}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
