"""Flights of many given scenarios at the same time, outside a search."""

from __future__ import annotations

import dataclasses
import json
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pytest_garl.errors import LedgerError
from pytest_garl.execution.checkout import Checkout
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot, search_key
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.pool import Pool, wait_for
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.scenario import Scenario


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


@contextmanager
def temporary_pool(workers: int, checkout: Checkout | None = None) -> Iterator[tuple[Ledger, Pool]]:
    """Yield a temporary ledger and its pool of workers; both end with the ``with`` block.

    The workers import landing systems from ``checkout`` only, if it is given.
    """
    with tempfile.TemporaryDirectory(prefix="garl-") as scratch:
        ledger = Ledger.create(Path(scratch) / "ledger.sqlite", {})
        pool = local_pool(ledger.queue, workers, checkout)
        try:
            yield ledger, pool
        finally:
            pool.close()
            ledger.close()
