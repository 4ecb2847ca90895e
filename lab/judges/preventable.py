"""Judge 3: how many preventable violations one chasing NPC causes, by who lets it begin."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.arms import DOMAIN, arm_named
from lab.judges.flights import MAPS, Flights, flights_for, fly_each, named
from lab.judges.intervals import over_pairs
from lab.judges.tasks import Task
from lab.one_search import flights_of
from lab.table import ResultTable, Row, share
from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import OFF, ON
from pytest_garl.scenarios.groups import DECIDED
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, STORY_MOMENTS
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.investigation import build_case

FLIGHTS, GENERATION = 100, 10
SEEDS = (20,)
ARMS = ("gene", "rule", "untrained", "shipped", "garl")
OURS = "garl"
CASE_FLIGHTS = 12
NEAR_TOUCHDOWN_S = 1.0
SLOWEST_MPS = 0.2
AT_DECISION = STORY_MOMENTS.index(DECIDED)
TABLE = ResultTable(
    file=Path("docs/results/judge-preventable.csv"),
    columns=(
        *("arm", "system", "map", "seed", "flights", "counted", "sensor_limited", "unpreventable"),
        *("edge", "near_touchdown", "collisions", "violations", "hits", "commit"),
    ),
    key=("arm", "system", "map", "seed"),
)


def scenario_of(map_name: str, seed: int, number: int, *, as_gene: bool) -> Scenario:
    """Return a scenario: everything nominal but the marker's place and one chasing NPC.

    Its moment is the director's decision, or as a gene one of the others, drawn evenly.
    """
    map = load_map(map_name)
    genome = genome_of(DOMAIN, map, is_dense=True)
    rng = np.random.default_rng([seed, MAPS.index(map_name), number])
    names = [name for name, _ in map.present_objects]
    chosen, row = names[number % len(names)], []
    for gene in genome.genes:
        for item in gene.properties:
            # All arms draw alike.
            drawn = float(rng.uniform(item.low, item.high))
            value = item.nominal
            if gene.is_optional and item is gene.properties[0]:
                value = ON if gene.name == chosen else OFF
            elif item.key.endswith(".phase"):
                moment = drawn / item.high * AT_DECISION if as_gene else float(AT_DECISION)
                value = min(moment, AT_DECISION - 1e-6) if as_gene else moment
            elif item.key.endswith(".grade"):
                value = float(GRADES.index("chasing"))
            elif gene.name == chosen or item.key.startswith("marker."):
                value = drawn
            row.append(value)
    return repair(decode(np.array(row), genome, map=map_name, seed=number), map)


class GivenScenarios:
    """Asks for given scenarios, generation by generation, as a search that overlaps does."""

    learns = True
    overlaps = True

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self._left = iter(scenarios)

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        return list(itertools.islice(self._left, GENERATION))

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Learn nothing."""
        return [() for _ in flown]


@dataclass(frozen=True, slots=True, kw_only=True)
class PreventableTask(Task):
    """The flights of an arm with one landing system on one map."""

    arm: str
    system: str
    map: str
    seed: int
    flights: int = FLIGHTS

    @property
    def name(self) -> str:
        """The name of its file."""
        return named(arm=self.arm, system=self.system, map=self.map, seed=self.seed)

    def row(self) -> dict[str, Any]:
        """Fly the scenarios, and make a case of each collision with the NPC."""
        with tempfile.TemporaryDirectory() as folder:
            fly = flights_for(self.system, load_map(self.map), Path(folder))
            ends = [end_of(*flown, fly) for flown in self._flights(fly)]
        counts = {
            name: ends.count(name)
            for name in ("counted", "sensor_limited", "unpreventable", "edge", "near_touchdown")
        }
        collisions = sum(end not in ("", "other") for end in ends)
        return {
            **dataclasses.asdict(self),
            **counts,
            "collisions": collisions,
            "violations": sum(bool(end) for end in ends),
            "hits": "".join("01"[end == "counted"] for end in ends),
            "told": f"{counts['counted']} of {collisions} collisions count",
        }

    def _flights(self, fly: Flights) -> Iterator[tuple[Scenario, CompletedFlight]]:
        """Yield the scenario of each flight, in which nothing is left to decide, and the flight."""
        scenarios = [
            scenario_of(self.map, self.seed, number, as_gene=self.arm == "gene")
            for number in range(self.flights)
        ]
        arm = dataclasses.replace(arm_named(self.arm), make=lambda plan: GivenScenarios(scenarios))
        map = load_map(self.map)
        plan = SearchPlan(
            map=map,
            genome=genome_of(DOMAIN, map),
            seed=self.seed,
            flights=self.flights,
            population=GENERATION,
        )
        latest: list[CompletedFlight] = []
        fly_all = functools.partial(fly_each, fly, latest)
        for flight in flights_of(arm, plan, self.flights, fly_all, fly.airframe):
            yield flight.scenario.replace(dict(flight.result.decided)), latest[0]


def end_of(scenario: Scenario, flown: CompletedFlight, fly: Flights) -> str:
    """Return how a flight ended for the judge; empty without a violation.

    "counted", why a collision with the NPC does not count, or "other" for any other violation.
    """
    verdict = flown.result.verdict
    if not verdict.violation:
        return ""
    if verdict.violation_type != "IV":
        return "other"
    if is_near_touchdown(load(flown.record)):
        return "near_touchdown"
    request = CaseRequest(
        name="judge",
        signature=flown.signature,
        violations=((scenario, flown),),
        job=fly.job,
        map=fly.job.load_map(),
        budget=CASE_FLIGHTS,
    )
    case = build_case(request, fly).case
    if case is None or case.reason == "edge":
        return "edge"
    if case.gates:
        return "counted" if case.prevention.answer == "preventable" else "unpreventable"
    return case.reason.replace("-", "_")


def is_near_touchdown(flight: Flight) -> bool:
    """Whether the UAV touched down within a second before the contact, or would have after it.

    It would have if it had sunk on as fast as at the contact.
    """
    contact, touchdown = flight.contacts[-1], flight.touchdown
    if touchdown is not None and touchdown.time_s <= contact.time_s:
        return contact.time_s - touchdown.time_s <= NEAR_TOUCHDOWN_S
    place = flight.uav.index_at(contact.time_s)
    height_m = feet_height_m(float(flight.uav.position_m[place, 2]))
    sinks_mps = max(SLOWEST_MPS, -float(flight.uav.velocity_mps[place, 2]))
    return height_m < NEAR_TOUCHDOWN_S * sinks_mps


def tasks(
    arms: Iterable[str], systems: Iterable[str], seeds: Iterable[int], flights: int
) -> list[PreventableTask]:
    """Return the tasks; all arms of a system and a map come before the next."""
    kinds = list(arms)
    return [
        PreventableTask(arm=arm, system=system, map=map, seed=seed, flights=flights)
        for seed, system, map in itertools.product(seeds, systems, MAPS)
        for arm in kinds
    ]


def report(rows: Sequence[Row]) -> str:
    """Return the tables in Markdown."""
    if not rows:
        return "nothing is flown"
    arms = list(dict.fromkeys(row["arm"] for row in rows))
    lines = [
        "Violations that one chasing NPC causes and somebody could have prevented, per 100 "
        "flights, both maps and all systems; ratios and differences to garl over the scenarios "
        "that arms share, with 95 % intervals.",
        "",
        "| arm | flights | count | garl, times | garl less it, per 100 | sensor-limited "
        "| unpreventable | edge | near the touchdown | other violations |",
        f"| --- | ---: | --- | --- | --- |{' ---: |' * 5}",
    ]
    for arm in arms:
        own = [row for row in rows if row["arm"] == arm]
        total = {name: sum(int(row[name]) for row in own) for name in TABLE.columns[4:12]}
        other = total["violations"] - total["collisions"]
        cells = [
            str(total["flights"]),
            share(total["counted"], total["flights"]),
            *_against(rows, arm),
            *(str(total[name]) for name in TABLE.columns[6:10]),
            str(other),
        ]
        lines.append(f"| {arm} | {' | '.join(cells)} |")
    lines += ["", f"| system | {' | '.join(arms)} | {' | '.join(f'garl less {a}' for a in arms)} |"]
    lines.append(f"| --- |{' ---: |' * len(arms)}{' --- |' * len(arms)}")
    for system in dict.fromkeys(row["system"] for row in rows):
        part = [row for row in rows if row["system"] == system]
        counts = [
            str(sum(int(row["counted"]) for row in part if row["arm"] == arm)) for arm in arms
        ]
        against = [_against(part, arm)[1] for arm in arms]
        lines.append(f"| {system} | {' | '.join((*counts, *against))} |")
    commits = ", ".join(sorted({row["commit"] for row in rows}))
    return "\n".join([*lines, "", f"Flown at {commits}."])


def _against(rows: Sequence[Row], arm: str) -> tuple[str, str]:
    """Return the ratio and the difference per 100 flights of ours to an arm."""
    hits = {(row["arm"], row["system"], row["map"], row["seed"]): row["hits"] for row in rows}
    pairs = [
        (int(one), int(other))
        for key, rival in hits.items()
        if key[0] == arm and (OURS, *key[1:]) in hits
        for one, other in zip(hits[OURS, *key[1:]], rival, strict=False)
    ]
    if arm == OURS or not pairs:
        return "–", "–"
    own, rivals = zip(*pairs, strict=True)
    return (
        over_pairs(own, rivals, difference=False).text(),
        over_pairs(own, rivals, difference=True).text(1, 100),
    )
