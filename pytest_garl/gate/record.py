"""Record a baseline: fly scenarios, or take the flights of a finished search."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pytest_garl.engine import Engine, chosen, packages
from pytest_garl.errors import BaselineError, PolicyError
from pytest_garl.execution.checkout import Checkout, locate_system
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.execution.stored_ledger import checked_ledger
from pytest_garl.gate.baseline_file import Baseline, BaselineFlight, BaselineSet
from pytest_garl.gate.gate import FlyScenarios
from pytest_garl.gate.pairs import summary_of
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.npcs.policy_check import check_policy
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Limits

ShowProgress = Callable[[Iterator[CompletedFlight], str, int], Iterable[CompletedFlight]]
"""Passes flights on and shows the progress: (flights, title, total) -> the same flights."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineSpec:
    """Scenarios of a baseline and conditions of the flights; equal specs draw equal scenarios."""

    maps: tuple[str, ...] = ("court", "lawn")
    count: int = 100
    seed: int = 0
    domain: Domain = field(default_factory=lambda: domain_named(DEFAULT_DOMAIN))
    npcs: str = "waypoint"
    limits: Limits = field(default_factory=Limits)
    simulator: Reference = BUILT_IN
    map_folders: tuple[Path, ...] = ()

    def scenarios(self, map: Map) -> Sequence[Scenario]:
        """Return the random scenarios on a map: the first generation of random search."""
        return random_scenarios(map, genome_of(self.domain, map), self.seed, 0, self.count)


def fly_baseline(
    spec: BaselineSpec,
    checkout: Checkout,
    systems: Sequence[str],
    workers: int,
    show_progress: ShowProgress,
) -> Baseline:
    """Fly the scenarios with landing systems ("module:class") of one checkout."""
    located = [locate_system(checkout, system) for system in systems]
    npcs = policy_spec(spec.npcs)
    maps = [load_map(name, spec.map_folders) for name in spec.maps]
    for map in maps:
        check_policy(npcs, map)
    sets = []
    with temporary_pool(workers, checkout) as (ledger, pool):
        for (reference, sources), map in itertools.product(located, maps):
            job = _job(spec, checkout, reference, sources, map, ledger.path.parent)
            scenarios = spec.scenarios(map)
            title = f"{checkout.folder}: {reference.qualname} on {map.name}"
            flights = show_progress(fly_all(ledger, pool, job, scenarios), title, len(scenarios))
            sets.append(_baseline_set(job, zip(scenarios, flights, strict=True), "random"))
    return _baseline(sets, chosen())


def neighbour_flyer(
    spec: BaselineSpec,
    checkout: Checkout,
    baseline_set: BaselineSet,
    workers: int,
    show_progress: ShowProgress,
) -> FlyScenarios:
    """Return a function that flies more scenarios with the landing system of a set."""

    def fly(scenarios: Sequence[Scenario]) -> Sequence[CompletedFlight]:
        reference, sources = locate_system(checkout, baseline_set.system)
        map = load_map(baseline_set.map, spec.map_folders)
        with temporary_pool(workers, checkout) as (ledger, pool):
            job = _job(spec, checkout, reference, sources, map, ledger.path.parent)
            title = f"{checkout.folder}: neighbours"
            return list(show_progress(fly_all(ledger, pool, job, scenarios), title, len(scenarios)))

    return fly


def _job(
    spec: BaselineSpec,
    checkout: Checkout,
    system: Reference,
    sources: str,
    map: Map,
    scratch: Path,
) -> FlightJob:
    return FlightJob.for_system(
        system,
        map,
        policy_spec(spec.npcs),
        system_sha256=sources,
        simulator=spec.simulator,
        map_folders=spec.map_folders,
        limits=spec.limits,
        path=(str(checkout.folder.resolve()),),
        flights=scratch / "flights",
    )


def baseline_from_ledger(path: Path) -> Baseline:
    """Return the flights of a finished search; raise BaselineError if they make no baseline."""
    if not path.is_file():
        raise BaselineError(f"{path}: there is no ledger; run pytest --garl-budget=N first")
    with checked_ledger(path) as ledger:
        searches = [
            (parse_job(job), ledger.queries.flights(search)) for search, job in ledger.searches()
        ]
        method = ledger.facts.method or ""
    sets = []
    for job, rows in searches:
        _check_npcs(path, job.npcs)
        flights = [(row.repeatable, row.completed(Path(job.flights))) for row in rows]
        if flights:
            sets.append(_baseline_set(job, flights, method))
    if not sets:
        raise BaselineError(f"{path}: no search has flown anything yet")
    return _baseline(sets, searches[0][0].engine)


def _check_npcs(path: Path, npcs: PolicySpec) -> None:
    """Refuse an NPC policy that its name alone does not reproduce."""
    try:
        same = ":" not in npcs.name and policy_spec(npcs.name) == npcs
    except PolicyError:
        same = False
    if not same:
        raise BaselineError(
            f"{path}: found NPCs moved by {npcs.name!r} ({npcs.factory}), expected a shipped "
            "policy or unchanged weights; save a baseline of another search"
        )


def _baseline_set(
    job: FlightJob, flights: Iterable[tuple[Scenario, CompletedFlight]], method: str
) -> BaselineSet:
    return BaselineSet(
        system=job.system.name,
        map=job.map,
        map_sha256=job.map_sha256,
        simulator=job.simulator.name,
        npcs=job.npcs.name,
        npcs_sha256=job.npcs.sha256,
        method=method,
        limits=job.limits,
        flights=tuple(
            BaselineFlight(scenario=scenario, summary=summary_of(done.result, done.sha256))
            for scenario, done in flights
        ),
    )


def _baseline(sets: Sequence[BaselineSet], engine: Engine) -> Baseline:
    from pytest_garl.cpu_dispatch import cpu_class_of_flights
    from pytest_garl.flight.flight import version_of

    return Baseline(
        cpu=cpu_class_of_flights(),
        versions=tuple((name, version_of(name)) for name in packages(engine)),
        sets=tuple(sets),
    )
