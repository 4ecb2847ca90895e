"""Make a baseline, by flying or from a finished search, and compare a stack with it."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.adversary.policy_check import check_policy
from pytest_garl.baselines.comparison import LEVEL, Comparison, compare
from pytest_garl.baselines.file import Baseline, BaselineError, Sample, SampleSet
from pytest_garl.baselines.pairs import Answer, Pair, answer_of
from pytest_garl.errors import PolicyError
from pytest_garl.execution.batch import fly_all, own_pool
from pytest_garl.execution.checkout import Checkout, describe
from pytest_garl.execution.job import Job, load_scenario, loads
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.on_demand import Done
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.execution.stored_ledger import check_stored
from pytest_garl.regressions.robustness import COUNT, neighbours
from pytest_garl.scenarios.genes import WeatherRange, genome_for
from pytest_garl.scenarios.maps.map import Map, load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import propose
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import Limits

TIMEOUT_S = 10.0
Track = Callable[[Iterator[Done], str, int], Iterable[Done]]
"""Shows how far flights are: (flights, title, how many) -> the same flights."""
Fly = Callable[[Sequence[Scenario]], Sequence[Done]]
"""Flies scenarios with the head."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """Which scenarios are flown, and with what; equal surveys fly equal scenarios."""

    maps: tuple[str, ...] = ("court", "lawn")
    count: int = 100
    seed: int = 0
    weather: WeatherRange = "confined"
    npcs: str = "waypoint"
    limits: Limits = field(default_factory=Limits)
    simulator: Reference = BUILT_IN
    map_folders: tuple[Path, ...] = ()

    def scenarios(self, map: Map) -> Sequence[Scenario]:
        """Return the random scenarios on a map: the first generation of random search."""
        genome = genome_for(map, weather=self.weather)
        return propose(map, genome, self.seed, 0, self.count)


def survey_checkout(
    survey: Survey, checkout: Checkout, systems: Sequence[str], workers: int, track: Track
) -> Baseline:
    """Fly a survey with landing systems ("module:class") of one checkout."""
    found = [describe(checkout, system) for system in systems]
    npcs = policy_spec(survey.npcs)
    maps = [load_map(name, survey.map_folders) for name in survey.maps]
    for map in maps:
        check_policy(npcs, map)
    sets = []
    with own_pool(workers, checkout) as (ledger, pool):
        for (reference, sources), map in itertools.product(found, maps):
            job = _job(survey, checkout, reference, sources, map, ledger.path.parent)
            scenarios = survey.scenarios(map)
            title = f"{checkout.folder}: {reference.qualname} on {map.name}"
            flights = track(fly_all(ledger, pool, job, scenarios), title, len(scenarios))
            sets.append(_set(job, zip(scenarios, flights, strict=True), "random"))
    return _baseline(sets)


def fly_beside(
    survey: Survey, checkout: Checkout, of: SampleSet, workers: int, track: Track
) -> Fly:
    """Return what flies more scenarios with the landing system of a set that was surveyed."""

    def fly(scenarios: Sequence[Scenario]) -> Sequence[Done]:
        reference, sources = describe(checkout, of.system)
        map = load_map(of.map, survey.map_folders)
        with own_pool(workers, checkout) as (ledger, pool):
            job = _job(survey, checkout, reference, sources, map, ledger.path.parent)
            title = f"{checkout.folder}: neighbours"
            return list(track(fly_all(ledger, pool, job, scenarios), title, len(scenarios)))

    return fly


def _job(
    survey: Survey,
    checkout: Checkout,
    system: Reference,
    sources: str,
    map: Map,
    scratch: Path,
) -> Job:
    return Job(
        system=system,
        system_sha256=sources,
        simulator=survey.simulator,
        map=map.name,
        map_sha256=map.sha256,
        map_folders=tuple(str(folder.resolve()) for folder in survey.map_folders),
        npcs=policy_spec(survey.npcs),
        limits=survey.limits,
        timeout_s=TIMEOUT_S,
        path=(str(checkout.folder.resolve()),),
        flights=str(scratch / "flights"),
    )


def from_ledger(path: Path) -> Baseline:
    """Return what a search flew as a baseline; raise BaselineError for one that cannot be."""
    if not path.is_file():
        raise BaselineError(f"{path}: there is no ledger; run pytest --garl-budget=N first")
    ledger = Ledger(path)
    try:
        check_stored(ledger)
        searches = [(loads(job), ledger.queries.flown(search)) for search, job in ledger.searches()]
        method = str(ledger.fact("method") or "")
    finally:
        ledger.close()
    sets = []
    for job, rows in searches:
        _check_npcs(path, job.npcs)
        flights = [
            (
                load_scenario(row.scenario),
                Done(result=row.result, sha256=row.sha256, record=Path()),
            )
            for row in rows
        ]
        if flights:
            sets.append(_set(job, flights, method))
    if not sets:
        raise BaselineError(f"{path}: no search has flown anything yet")
    return _baseline(sets)


def _check_npcs(path: Path, npcs: PolicySpec) -> None:
    """Refuse a policy that the baseline's name for it does not bring back."""
    try:
        same = policy_spec(npcs.name) == npcs
    except PolicyError:
        same = False
    if not same:
        raise BaselineError(
            f"{path}: objects were moved by {npcs.name!r} ({npcs.factory}), which is neither a "
            "shipped policy nor weights as they are today; save a baseline of another search"
        )


def _set(job: Job, flights: Iterable[tuple[Scenario, Done]], method: str) -> SampleSet:
    return SampleSet(
        system=job.system.name,
        map=job.map,
        map_sha256=job.map_sha256,
        simulator=job.simulator.name,
        npcs=job.npcs.name,
        npcs_sha256=job.npcs.sha256,
        method=method,
        limits=job.limits,
        samples=tuple(
            Sample(scenario=scenario, answer=answer_of(done.result, done.sha256))
            for scenario, done in flights
        ),
    )


def _baseline(sets: Sequence[SampleSet]) -> Baseline:
    from pytest_garl.cpu_dispatch import of_children
    from pytest_garl.simulation.flight import PACKAGES

    return Baseline(
        cpu=of_children(),
        versions=tuple((name, version(name)) for name in PACKAGES),
        sets=tuple(sets),
    )


def unlike(base: SampleSet, job: Job) -> tuple[str, ...]:
    """Return what else than the landing system has changed: then no rates can be compared."""
    pairs = (
        ("limits", _words(base.limits), _words(job.limits)),
        (f"map {base.map}", base.map_sha256[:12], job.map_sha256[:12]),
        ("simulator", base.simulator, job.simulator.name),
        (f"weights of {base.npcs}", base.npcs_sha256[:12], job.npcs.sha256[:12]),
    )
    return tuple(
        f"{what}: saved with {then}, found {today}" for what, then, today in pairs if then != today
    )


def _words(limits: Limits) -> str:
    return f"{limits.distance_m:g} m, {limits.time_s:g} s, abort {limits.abort}"


def moved_on(base: Baseline) -> tuple[str, ...]:
    """Return what shapes a flight beside the stack and is not as when the baseline was saved."""
    from pytest_garl.cpu_dispatch import of_children

    cpu = of_children()
    found = [] if base.cpu == cpu else [f"the CPU was {base.cpu}, is {cpu}"]
    for name, then in base.versions:
        try:
            today = version(name)
        except PackageNotFoundError:
            today = "absent"
        if then != today:
            found.append(f"{name} was {then}, is {today}")
    return tuple(found)


def compare_flights(
    base: SampleSet,
    flights: Iterable[Done],
    map: Map,
    fly: Fly,
    *,
    level: float = LEVEL,
    known: Collection[str] = (),
) -> Comparison:
    """Return how flights of the base's scenarios, in its order, compare with it.

    ``fly`` flies neighbours of those in which a new type of violation shows.
    """
    answers = [answer_of(done.result, done.sha256) for done in flights]
    return _compare(base, answers, map, fly, level, known)


def compare_sets(
    base: SampleSet, head: SampleSet, map: Map, fly: Fly, *, level: float = LEVEL
) -> Comparison:
    """Return how two sets of the same scenarios compare; raise BaselineError for others."""
    if [each.scenario for each in base.samples] != [each.scenario for each in head.samples]:
        raise BaselineError(f"{base.title}: the two stacks did not fly the same scenarios")
    return _compare(base, [each.answer for each in head.samples], map, fly, level, ())


def _compare(
    base: SampleSet,
    head: Sequence[Answer],
    map: Map,
    fly: Fly,
    level: float,
    known: Collection[str],
) -> Comparison:
    pairs = [
        Pair(name=base.name(index), base=sample.answer, head=answer)
        for index, (sample, answer) in enumerate(zip(base.samples, head, strict=True))
    ]
    found = compare(pairs, level=level, known=known)
    asked = [pair.name for pair in found.to_confirm]
    if not asked:
        return found
    scenarios = {base.name(index): each.scenario for index, each in enumerate(base.samples)}
    done = fly([each for name in asked for each in neighbours(scenarios[name], map)])
    answers = [answer_of(flight.result, flight.sha256) for flight in done]
    beside = {
        name: answers[index * COUNT : (index + 1) * COUNT] for index, name in enumerate(asked)
    }
    return compare(pairs, level=level, known=known, neighbours=beside)
