"""A search for one fault, and the table of all searches."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import DEFAULT_POLICY, policy_spec
from pytest_garl.adversary.domain_policy import policy_in
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.search.catalogue import make_method
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.simulation.npc_policy import PolicySpec
from studies.faults.catalogue import fault_named
from studies.faults.fault import Fault, finds, result_of
from studies.table import Key, ResultTable

DOMAIN = domain_named("field")
POPULATION = 10
"""The size of a generation that a run with a budget of 100 flights has by default."""
TABLE = ResultTable(
    file=Path("docs/faults.csv"),
    columns=("method", "fault", "seed", "map", "found_at", "flights"),
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


def found_at(fault: Fault, method_name: str, seed: int, flights: int) -> int | None:
    """Return the number of the first flight that finds a fault; None if none of ``flights`` does.

    A violation of the faulty system is followed by a flight of the control, which is not counted.
    The search ends at the first find.
    """
    method = make_method(method_name, plan_of(fault, seed, flights))
    policy, flown = npcs(), 0
    while flown < flights:
        scenarios = list(method.ask())[: flights - flown]
        results: list[FlightResult] = []
        for scenario in scenarios:
            results.append(result_of(fault.faulty, scenario, policy))
            flown += 1
            if finds(fault, scenario, policy, results[-1]):
                return flown
        if method.learns and flown < flights:
            pairs = zip(scenarios, results, strict=True)
            method.tell([FlownScenario(scenario=each, result=result) for each, result in pairs])
    return None


def row_of(key: Key, flights: int) -> dict[str, Any]:
    """Search for one fault; return the row of the table."""
    import cv2

    cv2.setNumThreads(1)
    method, name, seed = key
    fault = fault_named(name)
    found = found_at(fault, method, int(seed), flights)
    row = dict(zip(TABLE.key, key, strict=True))
    return {**row, "map": fault.map, "found_at": found or "", "flights": found or flights}


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
