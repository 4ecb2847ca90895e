"""The worth of an archive: searches of several nights, with and without what earlier ones flew.

The searches fly the stand-in of ``lab/stand_in.py`` in the domain `field`, each night with another
seed.  ``python -m lab.nights`` flies what ``docs/nights.csv`` lacks; ``--report`` prints the table.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.ablations import LANDINGS, MAPS, interval
from lab.stand_in import stand_in
from lab.table import Key, ResultTable, Row, run_study
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.archive import Archive, ArchivedFlight, ArchivedSearch
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import Garl

NIGHTS, BUDGET, POPULATION = 5, 100, 10
VARIANTS = ("alone", "archive")
SEEDS = tuple(str(seed) for seed in range(220, 224))
Counts = NDArray[np.int64]
NIGHT = 1000
"""The seeds of the nights of a study lie so far apart."""
TABLE = ResultTable(
    file=Path("docs/nights.csv"),
    columns=("variant", "landing", "seed", "map", "kinds", "violations"),
    key=("variant", "landing", "seed", "map"),
)


def search(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly the nights of a study in another process; return its row."""
    return pool.submit(fly_nights, key).result()


def fly_nights(key: Key) -> dict[str, Any]:
    """Fly the nights of a study; return its row.

    ``kinds`` are those that are known after each night.
    """
    variant, landing, seed, map_name = key
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map)
    archive, seen, known, violations = Archive(), set[str](), list[int](), 0
    for night in range(NIGHTS):
        own = archive.knowledge("", "", genome, map)
        plan = SearchPlan(
            map=map,
            genome=genome,
            seed=int(seed) + NIGHT * night,
            population=POPULATION,
            known=own.known if variant == "archive" else (),
        )
        flown = _fly(plan, landing)
        shown = [result.signature for _, result in flown if result.signature]
        seen.update(shown)
        known.append(len(seen))
        violations += len(shown)
        flights = tuple(ArchivedFlight(scenario=text, result=result) for text, result in flown)
        latest = ArchivedSearch(search="", system="", map=map.name, flown_by="", flights=flights)
        archive = Archive(searches=(latest.after(*archive.searches or [None]),))
    return {
        "variant": variant,
        "landing": landing,
        "seed": seed,
        "map": map_name,
        "kinds": json.dumps(known),
        "violations": violations,
    }


def _fly(plan: SearchPlan, landing: str) -> list[tuple[str, FlightResult]]:
    """Fly the search of a night; return scenario and result of each flight."""
    method, flown = Garl(plan), list[tuple[str, FlightResult]]()
    for _ in range(BUDGET // plan.population):
        scenarios = method.ask()
        results = [stand_in(each, plan.map, LANDINGS[landing]) for each in scenarios]
        pairs = [*zip(scenarios, results, strict=True)]
        method.tell([FlownScenario(scenario=each, result=result) for each, result in pairs])
        flown += [(dump_scenario(each), result) for each, result in pairs]
    return flown


def report(rows: list[Row]) -> str:
    """Return the table in Markdown: new kinds of later nights, and their paired difference."""
    lines = [
        "| landing | pairs | kinds of the first night | nights | new kinds, alone | "
        "with the archive | difference |",
        "| --- | ---: | ---: | --- | ---: | ---: | ---: |",
    ]
    for landing in LANDINGS:
        of = {
            (row["variant"], row["seed"], row["map"]): np.array(json.loads(row["kinds"]))
            for row in rows
            if row["landing"] == landing
        }
        pairs = [
            (kinds, of["archive", seed, map])
            for (variant, seed, map), kinds in of.items()
            if variant == "alone" and ("archive", seed, map) in of
        ]
        if pairs:
            alone, kept = (np.array(own) for own in zip(*pairs, strict=True))
            first = f"{landing} | {len(pairs)} | {alone[:, 0].mean():.1f}"
            for nights, last in (("second", 1), ("second to fifth", NIGHTS - 1)):
                new = [own[:, last] - own[:, 0] for own in (alone, kept)]
                lines.append(f"| {first} | {nights} | {_cells(*new)} |")
    return "\n".join(lines)


def _cells(alone: Counts, kept: Counts) -> str:
    return f"{alone.mean():.1f} | {kept.mean():.1f} | {interval(list(kept - alone))}"


def main() -> None:
    """Fly the missing studies, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", default=list(SEEDS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_studies)


def fly_studies(arguments: argparse.Namespace) -> None:
    """Fly the studies that the table lacks."""
    keys = itertools.product(arguments.seeds, MAPS, LANDINGS, VARIANTS)
    TABLE.fly_missing(
        ((variant, landing, seed, map) for seed, map, landing, variant in keys),
        search,
        arguments.workers,
    )


if __name__ == "__main__":
    main()
