"""What an investigation of a violation is worth: flights, what it leaves, whether it is robust.

``python -m studies.shrinking`` searches in the domain `field` with ``garl`` for violations of the
reference systems, and of systems of the fault suite for the types that these do not show.  It takes
violations of as many kinds as possible, investigates each as a run does, with 12 flights, and
appends the rows that ``docs/shrinking.csv`` lacks; ``--budgets 40`` does so with 40 flights, and
``--report`` prints the tables.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Self

import numpy as np

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import DEFAULT_POLICY, policy_spec
from pytest_garl.adversary.domain_policy import policy_in
from pytest_garl.execution.flight import fly_job
from pytest_garl.execution.flight_id import CompletedFlight, FlightId, Slot, search_key
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.reference import Reference
from pytest_garl.regressions.case_file import dump_case
from pytest_garl.regressions.case_request import CaseRequest
from pytest_garl.regressions.investigation import build_case
from pytest_garl.regressions.removed import Contents
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.catalogue import find_method
from pytest_garl.search.method import FlownScenario, SearchPlan
from studies.table import ResultTable, Row, run_study, share

COUNT = 60
FLIGHTS, POPULATION, SEED = 100, 10, 3000
"""Of each search; no other study uses the seed."""
BUDGETS = (12, 40)
"""Flights of an investigation: those of a run, and of ``garl cases shrink``."""
SYSTEMS = {
    "opencv": "landing_systems.opencv_mls:OpenCvLandingSystem",
    "tphyolo": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    "mm": "landing_systems.mm_mls:MultiModuleLandingSystem",
    "two-markers": "studies.faults.families.identity:TwoMarkers",
    "fast-touchdown": "studies.faults.families.flight_control:FastTouchdown",
    "tight-gate": "studies.faults.families.decision:TightGate",
    "low-transit": "studies.faults.families.avoidance:LowTransit",
}
MAPS = ("court", "lawn")
FOLDER = Path(".garl/shrinking")
TABLE = ResultTable(
    file=Path("docs/shrinking.csv"),
    columns=(
        "system",
        "map",
        "slot",
        "signature",
        "budget",
        "flights",
        "objects_before",
        "objects",
        "conditions_before",
        "conditions",
        "values_before",
        "values",
        "end",
        "bytes",
    ),
    key=("system", "map", "slot", "budget"),
)
SearchKey = tuple[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """A violation of a search: where it was found, and its scenario as text."""

    system: str
    map: str
    slot: str
    signature: str
    scenario: str

    @classmethod
    def parse(cls, line: str) -> Self:
        """Return the violation in a line of a search's file."""
        return cls(**json.loads(line))

    def line(self) -> str:
        """Return its line in a search's file."""
        return f"{json.dumps(asdict(self))}\n"


def job_of(system: str, map_name: str, folder: Path) -> FlightJob:
    """Return the job of all flights of a system on a map in `field`."""
    module, _, name = SYSTEMS[system].partition(":")
    npcs = policy_spec(policy_in(domain_named("field"), DEFAULT_POLICY))
    reference = Reference(module=module, file="", qualname=name)
    return FlightJob.for_system(reference, load_map(map_name), npcs, flights=folder)


class Flights:
    """Flies in this process, each flight into a file of its own."""

    def __init__(self, name: str) -> None:
        self._search, self._count = search_key(name), 0

    def __call__(self, job: FlightJob, scenario: Scenario) -> CompletedFlight:
        """Fly a scenario."""
        flight = FlightId(
            search=self._search, map=job.map, slot=Slot(generation=0, index=self._count)
        )
        self._count += 1
        job.record(flight).parent.mkdir(parents=True, exist_ok=True)
        result, sha256, _ = fly_job(job, scenario, flight, None)
        return CompletedFlight(result=result, sha256=sha256, record=job.record(flight))


def search(key: SearchKey) -> None:
    """Search for violations, and write them into the search's file when it has ended."""
    import cv2

    cv2.setNumThreads(1)
    system, map_name = key
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map)
    plan = SearchPlan(map=map, genome=genome, seed=SEED, population=POPULATION)
    method = find_method("garl")(plan)
    fly, job = Flights(f"search-{system}-{map_name}"), job_of(system, map_name, FOLDER)
    lines = []
    for generation in range(FLIGHTS // POPULATION):
        scenarios = method.ask()
        flown = [(each, fly(job, each)) for each in scenarios]
        for index, (scenario, flight) in enumerate(flown):
            if flight.signature:
                violation = Violation(
                    system=system,
                    map=map_name,
                    slot=f"g{generation:02d}-s{index:02d}",
                    signature=flight.signature,
                    scenario=dump_scenario(scenario),
                )
                lines.append(violation.line())
        method.tell([FlownScenario(scenario=each, result=got.result) for each, got in flown])
    file_of(key).write_text("".join(lines))


def file_of(key: SearchKey) -> Path:
    """Return the file of a search's violations."""
    return FOLDER / f"{'-'.join(key)}.jsonl"


def violations(count: int) -> list[Violation]:
    """Return violations of all searches, with as many signatures as possible.

    First comes one of each signature, then one of each that a system has on a map, then a second.
    """
    kinds: defaultdict[tuple[str, str, str], list[Violation]] = defaultdict(list)
    for key in itertools.product(SYSTEMS, MAPS):
        for line in file_of(key).read_text().splitlines():
            each = Violation.parse(line)
            kinds[each.system, each.map, each.signature].append(each)
    turns = itertools.zip_longest(*kinds.values())
    ordered = [each for turn in turns for each in turn if each is not None]
    first = {each.signature: each for each in reversed(ordered)}
    return sorted(ordered, key=lambda each: first[each.signature] is not each)[:count]


def investigate(violation: Violation, budget: int) -> dict[str, Any]:
    """Investigate a violation as a run does; return its row."""
    import cv2

    cv2.setNumThreads(1)
    scenario = parse_scenario(violation.scenario)
    name = f"{violation.system}-{violation.map}-{violation.slot}-{budget}"
    fly, job = Flights(name), job_of(violation.system, violation.map, FOLDER)
    found = fly(job, scenario)
    assert found.signature == violation.signature, violation
    request = CaseRequest(
        name=f"{name} {violation.signature}",
        signature=violation.signature,
        violations=((scenario, found),),
        job=job,
        map=job.load_map(),
        budget=budget,
    )
    made = build_case(request, fly)
    case = made.case
    before = Contents.of(scenario)
    after = Contents.of(case.scenario) if case else None
    end = (case.reason or "gates") if case else "not repeated"
    return {
        **{name: getattr(violation, name) for name in ("system", "map", "slot", "signature")},
        "budget": budget,
        "flights": made.flights,
        "objects_before": before.objects,
        "objects": after.objects if after else "",
        "conditions_before": before.conditions,
        "conditions": after.conditions if after else "",
        "values_before": before.values,
        "values": after.values if after else "",
        "end": end,
        "bytes": len(dump_case(case).encode()) if case else "",
    }


def report(rows: list[Row]) -> str:
    """Return Markdown tables: medians by budget, and by type with a run's budget."""
    head = (
        "violations | kinds | flights | objects | conditions | values | gate | on an edge "
        "| not repeated | largest file, bytes |"
    )
    rule = f"| --- |{' ---: |' * 10}"
    lines = [f"| flights each | {head}", rule]
    for budget in BUDGETS:
        own = [row for row in rows if row["budget"] == str(budget)]
        if own:
            lines.append(f"| {budget} | {_cells(own)}")
    lines += ["", f"| type, {BUDGETS[0]} flights | {head}", rule]
    first = [row for row in rows if row["budget"] == str(BUDGETS[0])]
    for kind in sorted({_type(row) for row in first}):
        lines.append(f"| {kind} | {_cells([row for row in first if _type(row) == kind])}")
    return "\n".join(lines)


def _type(row: Row) -> str:
    return row["signature"].partition(":")[0]


def _cells(rows: list[Row]) -> str:
    """Return the cells of a line; medians of what was there and of what is left."""
    made = [row for row in rows if row["bytes"]]
    ends = Counter(row["end"] for row in rows)
    cells = [len(rows), len({row["signature"] for row in rows})]
    texts = [f"{_median(rows, 'flights')}"]
    texts += [
        f"{_median(made, f'{name}_before')} → {_median(made, name)}"
        for name in ("objects", "conditions", "values")
    ]
    texts += [share(ends["gates"], len(rows)), str(ends["edge"]), str(ends["not repeated"])]
    texts.append(str(max((int(row["bytes"]) for row in made), default=0)))
    return f"{' | '.join(map(str, cells))} | {' | '.join(texts)} |"


def _median(rows: list[Row], name: str) -> str:
    return f"{np.median([float(row[name]) for row in rows]):g}" if rows else "–"


def main() -> None:
    """Investigate the missing violations, or print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--budgets", nargs="+", type=int, default=[BUDGETS[0]])
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_missing)


def fly_missing(arguments: argparse.Namespace) -> None:
    """Search where that is not done, then investigate the violations that the table lacks."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    cpu_dispatch.pin()
    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        keys = [key for key in itertools.product(SYSTEMS, MAPS) if not file_of(key).exists()]
        _wait(pool.submit(search, key) for key in keys)
        known = TABLE.keys()
        wanted = [
            (each, budget)
            for budget in arguments.budgets
            for each in violations(arguments.count)
            if (each.system, each.map, each.slot, str(budget)) not in known
        ]
        runs = (pool.submit(investigate, each, budget) for each, budget in wanted)
        _wait(runs, lambda row: TABLE.append([row]))


def _wait(runs: Iterable[Any], take: Callable[[Any], None] = lambda result: None) -> None:
    for run in as_completed([*runs]):
        take(run.result())


if __name__ == "__main__":
    main()
