"""One search for a landing system of any module: a row per flight, and an end at the first find.

    python -m lab.one_search landing_systems.opencv_mls:OpenCvLandingSystem --map=court
        --seed=300 --arm=garl --flights=100 --until=^IV:person --out=flights.csv

flies the domain `field` with an arm of ``lab/arms.py`` until a flight's signature matches
``--until``, a regular expression, or until all flights are flown.  The flights of a generation fly
at once; a search has the same rows for any number of workers.  A search that is whole in the file
is not flown again.
"""

from __future__ import annotations

import argparse
import functools
import os
import re
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from lab.arms import ARMS, DOMAIN, FROZEN, Arm, arm_named
from lab.table import ResultTable
from pytest_garl.errors import GarlError
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.reference import system_named
from pytest_garl.execution.result import FlightResult, Origin
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Airframe, airframe_of
from pytest_garl.npcs.director_progress import Outcome
from pytest_garl.npcs.search_directors import SearchDirectors
from pytest_garl.plugin.options import population
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.teaching import outcome_of
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

COLUMNS = (
    *("system", "map", "arm", "seed", "flight", "how", "parents"),
    *("signature", "no_landing", "elapsed_s", "is_last"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTask:
    """What is searched: the landing system "module:Class", map, arm and seed, and until when."""

    system: str
    map: str
    arm: str
    seed: int
    flights: int
    until: str = ""
    """A regular expression for a signature; empty if all flights are flown."""

    @property
    def key(self) -> tuple[str, ...]:
        """What identifies the search in a table."""
        return self.system, self.map, self.arm, str(self.seed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Flown:
    """A judged flight, with its record if a director is to learn from it."""

    result: FlightResult
    record: Flight | None = None


def fly_one(system: str, npcs: PolicySpec, scenario: Scenario) -> Flown:
    """Fly a landing system through a scenario."""
    import cv2

    cv2.setNumThreads(1)
    return flown_by(system_named(system), npcs, scenario)


def flown_by(system: Any, npcs: PolicySpec, scenario: Scenario) -> Flown:
    """Fly a landing system's class through a scenario."""
    flight = fly(scenario, system, npcs, map=load_map(scenario.map))
    return Flown(result=judged(flight, DEFAULT_LIMITS), record=flight)


def plan_of(map_name: str, seed: int, flights: int) -> SearchPlan:
    """Return the plan of a search, with generations as large as those of pytest by default."""
    map = load_map(map_name)
    genome = genome_of(DOMAIN, map)
    return SearchPlan(
        map=map, genome=genome, seed=seed, flights=flights, population=population(flights)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchFlight:
    """One flight of a search: its number from 1 on, and who moved its NPCs."""

    number: int
    scenario: Scenario
    npcs: PolicySpec
    origin: Origin
    result: FlightResult


FlyAll = Callable[[PolicySpec, Sequence[Scenario]], Iterator[Flown]]
"""Flies scenarios among NPCs of a policy; the flights come in order."""


def flights_of(
    arm: Arm, plan: SearchPlan, count: int, fly_all: FlyAll, airframe: Airframe | None = None
) -> Iterator[SearchFlight]:
    """Yield the flights of a search, generation by generation; who stops asking ends it.

    With the airframe of the landing system the arm's directors learn from the flights, if they do,
    one generation behind, as in a run of pytest.
    """
    method, number = arm.make(plan), 0
    director = None
    if airframe is not None and method.learns and arm.learns:
        director = SearchDirectors(plan.map, airframe)
    untaught: deque[list[tuple[Scenario, Flight, Outcome]]] = deque()
    npcs = arm.npcs
    while number < count:
        scenarios = list(method.ask())
        origins = getattr(method, "origins", ()) or [Origin(how="control")] * len(scenarios)
        flown: list[Flown] = []
        flights = fly_all(npcs, scenarios[: count - number])
        for scenario, origin, flight in zip(scenarios, origins, flights, strict=False):
            flown.append(flight)
            number += 1
            yield SearchFlight(
                number=number, scenario=scenario, npcs=npcs, origin=origin, result=flight.result
            )
        if number == count:
            return
        pairs = list(zip(scenarios, flown, strict=True))
        if method.learns:
            method.tell([FlownScenario(scenario=each, result=f.result) for each, f in pairs])
        if director is not None:
            is_first = number == len(scenarios)
            untaught.append(
                [
                    (each, f.record, outcome_of(f.result))
                    for each, f in pairs
                    if f.record is not None
                ]
            )
            while len(untaught) > (0 if is_first or not method.overlaps else 1):
                director.learn(untaught.popleft())
            npcs = arm.npcs.directed_by(director.text)


def rows_of(
    task: SearchTask, fly_all: FlyAll, airframe: Airframe | None = None
) -> Iterator[dict[str, Any]]:
    """Yield the row of each flight, up to the first that matches."""
    plan = plan_of(task.map, task.seed, task.flights)
    for flight in flights_of(arm_named(task.arm), plan, task.flights, fly_all, airframe):
        result = flight.result
        hit = bool(task.until) and re.search(task.until, result.signature) is not None
        is_last = hit or flight.number == task.flights
        yield {
            **dict(zip(COLUMNS, task.key, strict=False)),
            "flight": flight.number,
            "how": flight.origin.how,
            "parents": " ".join(flight.origin.parents),
            "signature": result.signature,
            "no_landing": result.verdict.no_landing or "",
            "elapsed_s": round(result.elapsed_s, 3),
            "is_last": int(is_last),
        }
        if is_last:
            return


def run(
    task: SearchTask, table: ResultTable, pool: Executor, airframe: Airframe | None = None
) -> None:
    """Append the rows of a search, unless the table has all of them."""
    own = [row for row in table.rows() if tuple(row[name] for name in COLUMNS[:4]) == task.key]
    if any(row["is_last"] == "1" for row in own):
        return
    known = {row["flight"] for row in own}

    def fly_all(npcs: PolicySpec, scenarios: Sequence[Scenario]) -> Iterator[Flown]:
        return pool.map(functools.partial(fly_one, task.system, npcs), scenarios)

    # A search that was interrupted is flown again, and its rows are the same.
    table.append(row for row in rows_of(task, fly_all, airframe) if str(row["flight"]) not in known)


def main() -> None:
    """Fly one search."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("system", metavar="MODULE:CLASS")
    parser.add_argument("--map", default="court")
    arms = ", ".join(arm for arm in ARMS if arm != FROZEN)
    parser.add_argument("--arm", default="garl", help=f"{arms}, rule@SECONDS; default garl")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flights", type=int, default=100)
    parser.add_argument("--until", default="", help="regular expression; without it all are flown")
    parser.add_argument("--out", type=Path, default=Path("flights.csv"))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    named = vars(parser.parse_args())
    table = ResultTable(file=named.pop("out"), columns=COLUMNS, key=(*COLUMNS[:4], "flight"))
    workers = named.pop("workers")
    try:
        # Whoever cannot be flown is told before a process starts.
        re.compile(named["until"])
        airframe = airframe_of(system_named(named["system"]))
        load_map(named["map"])
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            run(SearchTask(**named), table, pool, airframe)
    except (GarlError, re.error) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
