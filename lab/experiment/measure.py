"""Measure a finished search: its row, from the ledger and the records of the flights."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.experiment.paper_code import violates_in_its_code
from lab.experiment.results import ResultRow
from lab.experiment.spec import PAPER_TYPES, ExperimentRun
from pytest_garl.cpu_dispatch import cpu_class_of_flights
from pytest_garl.errors import ExperimentError
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.flight.flight_file import load
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.groups import WEATHER
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.paper_metrics import empty_cells, mark_visited, mean_distance, top_k
from pytest_garl.verdicts.verdict import Limits, Verdict

HASH_DIGITS = 12
"""Number of digits of a hash in a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FinishedSearch:
    """A finished search: its key in the ledger, its job, its flights in slot order."""

    key: str
    job: FlightJob
    flights: tuple[LedgerFlight, ...]

    @property
    def map(self) -> Map:
        """The map that was flown."""
        return self.job.load_map()

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The verdicts of the flights."""
        return tuple(flight.result.verdict for flight in self.flights)

    @property
    def violating(self) -> tuple[LedgerFlight, ...]:
        """The flights that violate a property by the limits of their run."""
        return tuple(flight for flight in self.flights if flight.result.verdict.violation)


def finished_searches(run: ExperimentRun, ledger: Ledger) -> tuple[FinishedSearch, ...]:
    """Return the search of a run on each map; raise ExperimentError if one is not finished."""
    found: dict[str, FinishedSearch] = {}
    for key, text in ledger.searches():
        job = parse_job(text)
        if job.map in found:
            raise ExperimentError(
                f"{run.tests}: found more than one landing system with tests on {job.map}, "
                "expected one; name a file, or one of its tests, that has one"
            )
        found[job.map] = FinishedSearch(
            key=key, job=job, flights=tuple(ledger.queries.flights(key))
        )
    for map in run.maps:
        flown = len(found[map].flights) if map in found else 0
        if flown != run.budget:
            raise ExperimentError(
                f"{run.title}: found {flown} flights on {map} in {ledger.path}, expected "
                f"{run.budget}; do the tests in {run.tests} name this map?"
            )
    return tuple(found[map] for map in run.maps)


def result_row(
    run: ExperimentRun,
    search: FinishedSearch,
    ledger: Ledger,
    *,
    workers: int,
) -> ResultRow:
    """Return the row of one search of a run."""
    return ResultRow(
        system=run.system,
        map=search.job.map,
        method=run.method,
        seed=run.seed,
        budget=run.budget,
        domain=run.domain,
        engine=search.job.engine,
        workers=workers,
        machine=cpu_class_of_flights(),
        result_hash=ledger.queries.result_hash(search.key)[:HASH_DIGITS],
        limits=_limits_cell(search.job.limits),
        **_violations(search),
        **_by_its_code(search),
        **_diversity(search, str(ledger.facts.domain)),
        **_durations(search, ledger),
        **_versions(search.job, ledger),
    )


def _limits_cell(limits: Limits) -> str:
    """Return limits as the saved rows of experiments have them."""
    return f"{limits.distance_m:g} m, {limits.time_s:g} s, abort {limits.abort}"


def _violations(search: FinishedSearch) -> dict[str, Any]:
    """Return the columns that count outcomes and violations."""
    verdicts = search.verdicts
    types = Counter[str](each.violation_type or "" for each in verdicts if each.violation)
    kinds = Counter(each.ending for each in verdicts if each.violation)
    without_landing = Counter[str](each.no_landing for each in verdicts)
    return {
        "violations": types.total(),
        "landed": sum(verdict.completed for verdict in verdicts),
        "paper": sum(verdict.paper_violation for verdict in verdicts),
        **{f"type_{name.lower()}": types[name] for name in PAPER_TYPES},
        **{name: types[name] for name in ("late", "off", "hard", "slid")},
        **{name: without_landing[name] for name in ("blocked", "excused", "needless")},
        "aborted": sum(verdict.outcome == "gave_up" for verdict in verdicts),
        "inconclusive": sum(flight.result.inconclusive for flight in search.flights),
        "top10": top_k(verdicts, by_the_paper=False),
        "signatures": tuple(sorted(kinds)),
        "kind_counts": tuple(kinds[name] for name in sorted(kinds)),
    }


def _by_its_code(search: FinishedSearch) -> dict[str, Any]:
    """Return the columns that count as the paper's code does."""
    cells, bounds_m = empty_cells(search.map.bounds_m), search.map.bounds_m
    found = []
    for number, each in enumerate(search.flights, start=1):
        if each.result.inconclusive:
            continue
        flight = load(search.job.record(each.id))
        if violates_in_its_code(flight, search.job.system.name.rpartition(":")[2]):
            found.append(number)
            mark_visited(cells, flight.uav.position_m, bounds_m)
    return {
        "its_code": len(found),
        "its_top10": found[9] if len(found) >= 10 else None,
        "its_covered": int(cells.sum()),
    }


def _diversity(search: FinishedSearch, domain: str) -> dict[str, Any]:
    """Return the columns of distances between scenarios and of coverage."""
    scenarios = [parse_scenario(flight.scenario) for flight in search.flights]
    raw_weather, genes = chromosomes(scenarios, search.map, domain)
    violating = np.array([verdict.violation for verdict in search.verdicts])
    cells = covered_cells(search)
    return {
        "parameter_distance": mean_distance(genes),
        "weather_distance": mean_distance(raw_weather),
        "violating_distance": mean_distance(genes[violating]) if violating.any() else None,
        "covered": int(cells.sum()),
        "cells": cells.size,
    }


def _durations(search: FinishedSearch, ledger: Ledger) -> dict[str, Any]:
    """Return the columns of flying and idle time; idle time is shared in proportion to flying."""
    flying_s = ledger.queries.flying_s(search.key)
    all_s = sum(ledger.queries.flying_s(key) for key, _ in ledger.searches())
    idle_s = ledger.queries.meters().get("idle_s", 0.0)
    return {"flying_s": flying_s, "idle_s": idle_s * flying_s / all_s if all_s else 0.0}


def _versions(job: FlightJob, ledger: Ledger) -> dict[str, Any]:
    """Return the columns that identify the code, the map and the NPC policy."""
    return {
        "landing_system": job.system.name,
        "landing_system_sha256": job.system_sha256[:HASH_DIGITS],
        "map_sha256": job.map_sha256[:HASH_DIGITS],
        "policy": job.npcs.name,
        "policy_sha256": job.npcs.sha256[:HASH_DIGITS],
        "version": str(ledger.facts.version),
        "package_sha256": str(ledger.facts.package_sha256),
    }


def chromosomes(
    scenarios: Sequence[Scenario], map: Map, domain: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the scenarios' weather genes, (n, 8), and their normalised genes, (n, d).

    The genes are those that every method has, so that distances are comparable.  The destinations
    of NPCs, which are genes of ``ga`` and ``offline-rl`` alone, are left out.  Whoever is not there
    counts as if it stood at its nominal place.
    """
    genome = genome_for(map, weather="confined" if domain == "paper" else "full")
    nominal = dict(zip(genome.keys, genome.nominal, strict=True))
    raw = [[each[gene] for gene in WEATHER] for each in scenarios]
    whole = [[each.get(key, nominal[key]) for key in genome.keys] for each in scenarios]
    return np.array(raw), genome.normalise(np.array(whole))


def covered_cells(search: FinishedSearch) -> NDArray[np.bool_]:
    """Return the cells of the map's volume, True where a violating flight passed through."""
    bounds_m = search.map.bounds_m
    cells = empty_cells(bounds_m)
    for flight in search.violating:
        mark_visited(cells, load(search.job.record(flight.id)).uav.position_m, bounds_m)
    return cells
