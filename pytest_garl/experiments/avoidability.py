"""Count the violations of an experiment that the reference pilot cannot avoid either."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from pytest_garl.errors import LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.experiments.measure import AvoidabilityCounts, FinishedSearch
from pytest_garl.regressions.avoidability import survives_recorded_moves
from pytest_garl.regressions.case_flights import recorded_behaviour
from pytest_garl.scenarios.files import parse_scenario


def count_unavoidable(
    searches: Sequence[FinishedSearch],
    path: Path,
    *,
    limit: int,
    seed: int,
    workers: int,
    on_wait: Callable[[], None],
) -> tuple[AvoidabilityCounts, ...]:
    """Let the reference pilot fly at most ``limit`` violating scenarios of each search.

    The pilot knows the positions of all bodies; the NPCs repeat their recorded moves and changes of
    the environment.  The scenarios are drawn by ``seed``, so their share is an estimate for all
    violations.  The flights have their own ledger at ``path``, so they count nowhere else; an
    interrupted call goes on from there.
    """
    drawn = {search.key: _drawn(search.violating, limit, seed) for search in searches}
    flights = {
        "pilot {} {} {}".format(*flight.id.key): functools.partial(_avoids, search, flight)
        for search in searches
        for flight in drawn[search.key]
    }
    with closing(_opened(path)) as ledger, closing(local_pool(ledger.queue, workers)) as pool:
        avoided = OnDemandFlights(ledger, pool, on_wait).run(flights)
    return tuple(
        AvoidabilityCounts(
            tried=len(drawn[search.key]),
            unavoidable=sum(
                not avoids for name, avoids in avoided.items() if f" {search.key} " in name
            ),
        )
        for search in searches
    )


def _drawn(violating: Sequence[LedgerFlight], limit: int, seed: int) -> list[LedgerFlight]:
    count = min(limit, len(violating))
    chosen = np.random.default_rng(seed).choice(len(violating), count, replace=False)
    return [violating[index] for index in sorted(int(each) for each in chosen)]


def _opened(path: Path) -> Ledger:
    with contextlib.suppress(LedgerError):
        return Ledger.resume(path, {})
    return Ledger.create(path, {})


def _avoids(search: FinishedSearch, flight: LedgerFlight, fly: FlyFunction) -> bool:
    """Return whether the reference pilot flies the scenario without a violation."""
    scenario, completed = (
        parse_scenario(flight.scenario),
        flight.completed(Path(search.job.flights)),
    )
    behaviour = recorded_behaviour(completed, scenario, search.map)
    return survives_recorded_moves(search.job, scenario, behaviour, fly)
