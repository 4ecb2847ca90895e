"""A search for one fault, and the table of all searches."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from lab.faults.catalogue import fault_named
from lab.faults.fault import Fault, finds, result_of
from lab.table import Key, ResultTable
from pytest_garl import cpu_dispatch
from pytest_garl.execution.result import FlightResult
from pytest_garl.npcs.domain_policy import policy_in
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY, policy_spec
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.simulation.npc_policy import PolicySpec

DOMAIN = domain_named("field")
POPULATION = 10
"""The size of a generation that a run with a budget of 100 flights has by default."""
TABLE = ResultTable(
    file=Path("docs/faults.csv"),
    columns=("method", "fault", "seed", "map", "found_at", "flights", "acted", "masked"),
    key=("method", "fault", "seed"),
)


def npcs() -> PolicySpec:
    """Return the NPC policy of the domain."""
    return policy_spec(policy_in(DOMAIN, DEFAULT_POLICY))


def plan_of(fault: Fault, seed: int, flights: int) -> SearchPlan:
    """Return the plan of a search for a fault."""
    map = load_map(fault.map)
    genome = genome_of(DOMAIN, map)
    return SearchPlan(map=map, genome=genome, seed=seed, population=min(POPULATION, flights))


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultSearch:
    """How a search for a fault went.

    ``found_at`` is the number of the flight that found it, None if none did.  In ``acted`` flights
    acted all that acts in the hand-made scenario, with other values.  In ``masked`` flights the
    control violated too.
    """

    found_at: int | None
    flights: int
    acted: int
    masked: int


def search_for(fault: Fault, method_name: str, seed: int, flights: int) -> FaultSearch:
    """Search until the first flight that finds a fault, or for ``flights`` flights.

    A violation of the faulty system is followed by a flight of the control, which is not counted.
    """
    plan = plan_of(fault, seed, flights)
    method, policy, columns = make_method(method_name, plan), npcs(), Columns(plan.genome)
    needed = acting(fault.scenario, columns) if fault.file.exists() else frozenset()
    flown = acted = masked = 0
    while flown < flights:
        scenarios = list(method.ask())[: flights - flown]
        results: list[FlightResult] = []
        for scenario in scenarios:
            results.append(result_of(fault.faulty, scenario, policy))
            flown += 1
            acted += bool(needed) and needed <= acting(scenario, columns)
            if finds(fault, scenario, policy, results[-1]):
                return FaultSearch(found_at=flown, flights=flown, acted=acted, masked=masked)
            masked += results[-1].verdict.violation
        if method.learns and flown < flights:
            pairs = zip(scenarios, results, strict=True)
            method.tell([FlownScenario(scenario=each, result=result) for each, result in pairs])
    return FaultSearch(found_at=None, flights=flown, acted=acted, masked=masked)


def acting(scenario: Scenario, columns: Columns) -> frozenset[str]:
    """Return the kinds of conditions and NPCs that act in a scenario, such as decoy or person."""
    active = columns.active(encode(scenario, columns.genome))
    return frozenset(gene.name.partition("-")[0] for gene in active)


def row_of(key: Key, flights: int) -> dict[str, Any]:
    """Search for one fault; return the row of the table."""
    import cv2

    cv2.setNumThreads(1)
    method, name, seed = key
    fault = fault_named(name)
    search = search_for(fault, method, int(seed), flights)
    row = dict(zip(TABLE.key, key, strict=True))
    return {**row, "map": fault.map, **asdict(search), "found_at": search.found_at or ""}


def search_missing(keys: Iterable[Key], flights: int, workers: int) -> None:
    """Append the row of each search that the table lacks, as soon as it has ended.

    A search runs in one process, so its row does not depend on the number of workers.
    """
    known = TABLE.keys()
    cpu_dispatch.pin()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        runs = [pool.submit(row_of, key, flights) for key in keys if key not in known]
        for run in as_completed(runs):
            TABLE.append([run.result()])
