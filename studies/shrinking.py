"""The worth of the shrinker's passes, on violations of OpenCV-MLS that a search found.

``python -m studies.shrinking`` searches with the defaults of pytest-garl and takes twenty
violations, as different ones as possible.  It shrinks each by both passes and by each alone, and
appends the rows that ``docs/shrinking.csv`` lacks; ``--report`` prints the table.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import os
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.execution.flight_id import CompletedFlight
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import FlyFunction, OnDemandFlights
from pytest_garl.experiments.pytest_run import run_pytest
from pytest_garl.experiments.spec import ExperimentRun
from pytest_garl.regressions.case_flights import find_colliding_object
from pytest_garl.regressions.shrink import (
    reset_and_bisect,
    round_values,
    shrink,
    shrink_by_hypothesis,
)
from pytest_garl.regressions.simplification import complexity, genome_of
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from studies.table import ResultTable, Row, run_study

COUNT = 20
SEARCH = ExperimentRun(
    system="OpenCV-MLS",
    tests="landing_systems/test_opencv_mls.py",
    maps=("court", "lawn"),
    method="garl",
    seed=0,
    budget=60,
)
"""The search that finds the violations."""
BUDGET = 40
AT_A_TIME = 5
PASSES: dict[str, tuple[Callable[..., None], ...]] = {
    "both": (reset_and_bisect, shrink_by_hypothesis, round_values),
    "reset and bisect": (reset_and_bisect,),
    "Hypothesis": (shrink_by_hypothesis,),
}
TABLE = ResultTable(
    file=Path("docs/shrinking.csv"),
    columns=(
        "passes",
        "map",
        "slot",
        "signature",
        "flights",
        "objects_before",
        "objects",
        "genes_before",
        "genes",
        "distance_before",
        "distance",
    ),
    key=("map", "slot", "passes"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """One violation to shrink."""

    job: FlightJob
    slot: str
    signature: str
    scenario: Scenario
    colliding_object: str


def violations(ledger: Ledger, count: int) -> list[Violation]:
    """Return violations, one of each kind, then a second of each, until there are enough."""
    kinds: defaultdict[tuple[str, str], list[LedgerFlight]] = defaultdict(list)
    for row in ledger.queries.violating():
        kinds[row.id.search, row.signature].append(row)
    turns = itertools.zip_longest(*kinds.values())
    rows = [row for turn in turns for row in turn if row is not None]
    return [_violation(ledger, row) for row in rows[:count]]


def _violation(ledger: Ledger, row: LedgerFlight) -> Violation:
    text = ledger.job(row.id.search)
    assert text is not None
    done = CompletedFlight(result=row.result, sha256=row.sha256, record=Path())
    return Violation(
        job=parse_job(text),
        slot=f"g{row.id.slot.generation:02d}-s{row.id.slot.index:02d}",
        signature=row.signature,
        scenario=parse_scenario(row.scenario),
        colliding_object=find_colliding_object(done),
    )


def shrink_one(violation: Violation, fly: FlyFunction) -> list[dict[str, Any]]:
    """Shrink a violation by all passes and by each alone; return a row for each."""
    known: dict[Scenario, bool] = {}

    def fails(scenario: Scenario) -> bool:
        # The next pass need not repeat a flight of an earlier pass; it counts for both.
        if scenario not in known:
            known[scenario] = fly(violation.job, scenario).signature == violation.signature
        return known[scenario]

    return [_row(violation, passes, fails) for passes in PASSES]


def _row(violation: Violation, passes: str, fails: Callable[[Scenario], bool]) -> dict[str, Any]:
    map = load_map(violation.job.map)
    found = shrink(
        violation.scenario,
        fails,
        map,
        BUDGET,
        colliding_object=violation.colliding_object,
        passes=PASSES[passes],
    )
    genome = genome_of(violation.scenario, map)
    before, after = (complexity(each, genome) for each in (violation.scenario, found.simplest))
    return {
        "passes": passes,
        "map": map.name,
        "slot": violation.slot,
        "signature": violation.signature,
        "flights": found.flights,
        "objects_before": before.objects,
        "objects": after.objects,
        "genes_before": before.genes,
        "genes": after.genes,
        "distance_before": before.distance,
        "distance": after.distance,
    }


def report(rows: list[Row]) -> str:
    """Return a Markdown table of medians."""
    lines = [
        "| passes | violations | flights | most | objects left | genes left | distance left |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    if rows:
        first = [row for row in rows if row["passes"] == rows[0]["passes"]]
        lines.append(
            f"| (as found) | {len(first)} | 0 | 0 | {' | '.join(_medians(first, '_before'))} |"
        )
    for passes in PASSES:
        own = [row for row in rows if row["passes"] == passes]
        if own:
            flights = [int(row["flights"]) for row in own]
            lines.append(
                f"| {passes} | {len(own)} | {np.median(flights):.0f} | {max(flights)} "
                f"| {' | '.join(_medians(own, ''))} |"
            )
    return "\n".join(lines)


def _medians(rows: list[Row], suffix: str) -> Iterator[str]:
    for name in ("objects", "genes", "distance"):
        yield f"{np.median([float(row[name + suffix]) for row in rows]):.3g}"


def main() -> None:
    """Shrink the missing violations, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, shrink_violations)


def shrink_violations(arguments: argparse.Namespace) -> None:
    """Search for violations, and shrink those that the table lacks."""
    found = Ledger(run_pytest(SEARCH, Path(".garl/shrinking/search"), arguments.workers, _ignore))
    known = {(row["map"], row["slot"]) for row in TABLE.rows()}
    wanted = [
        each
        for each in violations(found, arguments.count)
        if (each.job.map, each.slot) not in known
    ]
    path = Path(".garl/shrinking/ledger.sqlite")
    ledger = Ledger(path) if path.is_file() else Ledger.create(path, {})
    pool = local_pool(ledger.queue, arguments.workers)
    try:
        # As many at a time as keep the workers busy; their rows are saved before the next ones.
        for start in range(0, len(wanted), AT_A_TIME):
            functions = {
                f"{each.job.map} {each.slot}": functools.partial(shrink_one, each)
                for each in wanted[start : start + AT_A_TIME]
            }
            rows = OnDemandFlights(ledger, pool, lambda: None).run(functions)
            TABLE.append(itertools.chain.from_iterable(rows.values()))
    finally:
        pool.close()


def _ignore(progress: object) -> None:
    """Show no progress of the search."""


if __name__ == "__main__":
    main()
