"""The figures of a finished search, from its ledger and the records of its flights."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pytest_garl.cpu_dispatch import of_children
from pytest_garl.errors import ExperimentError
from pytest_garl.execution.job import FlightJob, load_scenario, loads
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.experiments.results import Row
from pytest_garl.experiments.spec import KINDS, Run
from pytest_garl.regressions.follow_up import done_of
from pytest_garl.scenarios.genes import WEATHER, genome_for
from pytest_garl.scenarios.maps.map import Map, load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.flight_file import load
from pytest_garl.verdicts.paper_metrics import empty_cells, mark_visited, mean_distance, top_k
from pytest_garl.verdicts.verdict import Verdict

HASH = 12
"""Digits of a hash that a row keeps."""
FACT_VERSION, FACT_SOURCES = "version", "sources of pytest-garl"


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """A finished search: its key in the ledger, its job, its flights in slot order."""

    key: str
    job: FlightJob
    flights: tuple[LedgerFlight, ...]

    @property
    def map(self) -> Map:
        """Where it flew."""
        return load_map(self.job.map, tuple(Path(each) for each in self.job.map_folders))

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """What the flights came to."""
        return tuple(flight.result.verdict for flight in self.flights)

    @property
    def violating(self) -> tuple[LedgerFlight, ...]:
        """The flights that violated as the paper defines it."""
        return tuple(
            flight
            for flight, verdict in zip(self.flights, self.verdicts, strict=True)
            if verdict.paper_violation
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Piloted:
    """How many violations the reference pilot tried to avoid, and how many it could not."""

    tried: int
    unavoidable: int


def searches_of(run: Run, ledger: Ledger) -> tuple[Search, ...]:
    """Return the run's search on each of its maps; raise ExperimentError for one not finished."""
    found: dict[str, Search] = {}
    for key, text in ledger.searches():
        job = loads(text)
        if job.map in found:
            raise ExperimentError(
                f"{run.tests}: found more than one landing system with tests on {job.map}, "
                "expected one; name a file, or one of its tests, that has one"
            )
        found[job.map] = Search(key=key, job=job, flights=tuple(ledger.queries.flown(key)))
    for map in run.maps:
        flown = len(found[map].flights) if map in found else 0
        if flown != run.budget:
            raise ExperimentError(
                f"{run.title}: found {flown} flights on {map} in {ledger.path}, expected "
                f"{run.budget}; do the tests in {run.tests} name this map?"
            )
    return tuple(found[map] for map in run.maps)


def row_of(
    run: Run, search: Search, ledger: Ledger, *, piloted: Piloted | None, workers: int
) -> Row:
    """Return the figures of one search of a run."""
    job, verdicts = search.job, search.verdicts
    kinds = Counter((each.violation_type or "").rstrip("?") for each in verdicts if each.violation)
    scenarios = [load_scenario(flight.scenario) for flight in search.flights]
    weather_of, genes = chromosomes(scenarios, search.map, str(ledger.fact("weather")))
    violating = np.array([each.paper_violation for each in verdicts])
    cells = covered(search)
    flying_s = ledger.queries.flying_s(search.key)
    all_s = sum(ledger.queries.flying_s(key) for key, _ in ledger.searches())
    return Row(
        system=run.system,
        map=job.map,
        method=run.method,
        seed=run.seed,
        budget=run.budget,
        violations=int(violating.sum()),
        **{f"type_{kind.lower()}": kinds[kind] for kind in KINDS},
        late=kinds["late"],
        off=kinds["off"],
        hard=kinds["hard"],
        aborted=sum(each.outcome == "aborted" for each in verdicts),
        inconclusive=sum(each.result.inconclusive for each in search.flights),
        unavoidable=piloted.unavoidable if piloted else None,
        piloted=piloted.tried if piloted else None,
        top10=top_k(verdicts),
        signatures=tuple(sorted({each.signature for each in verdicts if each.paper_violation})),
        parameter_distance=mean_distance(genes),
        weather_distance=mean_distance(weather_of),
        violating_distance=mean_distance(genes[violating]) if violating.any() else None,
        covered=int(cells.sum()),
        cells=cells.size,
        flying_s=flying_s,
        idle_s=ledger.queries.meters().get("idle_s", 0.0) * flying_s / all_s if all_s else 0.0,
        workers=workers,
        landing_system=job.system.name,
        landing_system_sha256=job.system_sha256[:HASH],
        map_sha256=job.map_sha256[:HASH],
        policy=job.npcs.name,
        policy_sha256=job.npcs.sha256[:HASH],
        version=str(ledger.fact(FACT_VERSION)),
        package_sha256=str(ledger.fact(FACT_SOURCES)),
        machine=of_children(),
        result_hash=ledger.queries.result_hash(search.key)[:HASH],
    )


def chromosomes(
    scenarios: Sequence[Scenario], map: Map, weather: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the scenarios' weather as it is, (n, 8), and their normalised genes, (n, d).

    The genes are those that every method breeds, so that distances can be compared: where objects
    are bound for, which only ``ga`` and ``offline-rl`` have as genes, is left out.
    """
    genome = genome_for(map, weather="full" if weather == "full" else "confined")
    raw = [[each[f"environment.{name}"] for name, _ in WEATHER] for each in scenarios]
    whole = [[each[key] for key in genome.keys] for each in scenarios]
    return np.array(raw), genome.normalise(np.array(whole))


def covered(search: Search) -> NDArray[np.bool_]:
    """Return which cells of the map's volume the violating flights passed through."""
    bounds_m = search.map.bounds_m
    cells = empty_cells(bounds_m)
    for flight in search.violating:
        mark_visited(cells, load(done_of(flight, search.job).record).uav.position_m, bounds_m)
    return cells
