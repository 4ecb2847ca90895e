"""NPC policies in full flights: landings, collisions, flights without landing, violations.

``python -m studies.adversary`` flies the flights that ``docs/adversary.csv`` lacks, in chunks of
fifty for each policy, landing system and map; it can be interrupted and started again at any time.
``--report`` prints the table.  The scenarios are random, in clear weather, and the same for every
policy.
"""

from __future__ import annotations

import argparse
import itertools
import os
from collections import Counter
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.experiments.measure import limits_text
from pytest_garl.scenarios.genes import WEATHER, genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Verdict
from studies.oracle import oracle_spec
from studies.table import Key, ResultTable, Row, definitions, run_study, share

SEED = 4242
CHUNK = 50
MOVERS = (
    "stationary",
    "random_walk",
    "waypoint",
    "greedy",
    "stand",
    "dqn-paper",
    "dqn",
    "oracle",
)
SYSTEMS = ("opencv", "avoiding")
MAPS = ("court", "lawn")
KINDS = ("person", "dog", "bird")
TABLE = ResultTable(
    file=Path("docs/adversary.csv"),
    columns=(
        "mover",
        "sha256",
        "system",
        "map",
        "chunk",
        "flights",
        "collided",
        *KINDS,
        "blocked",
        "violations",
        "crashed",
        "limits",
        "landed",
        "needless",
        "paper",
    ),
    key=("mover", "sha256", "system", "map", "chunk"),
)


def spec_of(mover: str) -> PolicySpec:
    """Return the specification of an NPC policy."""
    return oracle_spec() if mover == "oracle" else policy_spec(mover)


def sha256_of(mover: str) -> str:
    """Return the start of the hash of a learned policy's weights; empty for the others."""
    return spec_of(mover).sha256[:16]


def scenarios(map: str, chunk: int) -> list[Scenario]:
    """Return a chunk's scenarios: random, repaired, in clear weather."""
    place = load_map(map)
    clear = {f"environment.{name}": 0.0 for name, _ in WEATHER}
    return [
        each.replace(clear)
        for each in random_scenarios(place, genome_for(place), SEED, chunk, CHUNK)
    ]


def fly_one(job: tuple[Scenario, str, str]) -> tuple[Verdict, str]:
    """Return a flight's verdict and the kind of the object that it hit."""
    import cv2

    from landing_systems.opencv_mls import OpenCvLandingSystem
    from pytest_garl.simulation.fly import fly
    from pytest_garl.verdicts.judge import judge
    from studies.avoiding import AvoidingLandingSystem

    cv2.setNumThreads(1)
    scenario, mover, system = job
    made: Any = {"opencv": OpenCvLandingSystem, "avoiding": AvoidingLandingSystem}[system]
    flight = fly(scenario, made, spec_of(mover))
    hit = flight.outcome == "collision" and flight.contacts[-1].body_class == "dynamic"
    return judge(flight, DEFAULT_LIMITS), flight.contacts[-1].kind if hit else ""


def row_of(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly one chunk; return its row."""
    mover, _, system, map, chunk = key
    jobs = [(scenario, mover, system) for scenario in scenarios(map, int(chunk))]
    ends = list(pool.map(fly_one, jobs))
    verdicts = [verdict for verdict, _ in ends]
    hits = Counter(kind for _, kind in ends if kind)
    return {
        **dict(zip(TABLE.key, key, strict=True)),
        "flights": len(ends),
        "collided": hits.total(),
        **{kind: hits[kind] for kind in KINDS},
        "blocked": sum(bool(verdict.no_landing) for verdict in verdicts),
        "violations": sum(verdict.violation for verdict in verdicts),
        "crashed": sum(verdict.outcome == "crashed" for verdict in verdicts),
        "limits": limits_text(DEFAULT_LIMITS),
        "landed": sum(verdict.completed for verdict in verdicts),
        "needless": sum(verdict.no_landing == "needless" for verdict in verdicts),
        "paper": sum(verdict.paper_violation for verdict in verdicts),
    }


def by_the_paper(row: Row) -> int:
    """Return the flights without a landing within 1.5 m.

    An old row counts those that ended without a collision and without a landing apart.
    """
    return int(row["paper"] or int(row["violations"]) + int(row["blocked"]))


def landings(row: Row) -> int:
    """Return the flights that landed; in an old row all that did nothing else."""
    return int(row["landed"] or int(row["flights"]) - by_the_paper(row) - int(row["crashed"]))


def report(rows: list[Row]) -> str:
    """Return a Markdown table: per system, both maps and each, a row for each mover."""
    lines = [
        "| system | map | mover | flights | landed | collided | who (p / d / b) | no landing "
        "| violations | definition | paper's definition |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for system in SYSTEMS:
        for map in ("both", *MAPS):
            for mover in MOVERS:
                # Rows of weights other than the shipped ones are left out.
                key = (system, mover, sha256_of(mover))
                names = ("system", "mover", "sha256")
                own = [row for row in rows if tuple(row[name] for name in names) == key]
                own = [row for row in own if map in ("both", row["map"])]
                if not own:
                    continue
                flights = sum(int(row["flights"]) for row in own)
                counts = (
                    sum(landings(row) for row in own),
                    *(
                        sum(int(row[name]) for row in own)
                        for name in ("collided", "blocked", "violations")
                    ),
                    sum(by_the_paper(row) for row in own),
                )
                landed, collided, no_landing, violations, paper = (
                    share(count, flights) for count in counts
                )
                kinds = " / ".join(str(sum(int(row[kind]) for row in own)) for kind in KINDS)
                lines.append(
                    f"| {system} | {map} | {mover} | {flights} | {landed} | {collided} | {kinds} "
                    f"| {no_landing} | {violations} | {definitions(own)} | {paper} |"
                )
    return "\n".join(lines)


def main() -> None:
    """Fly the missing flights, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=150, help="per mover, system and map")
    parser.add_argument("--movers", nargs="+", default=list(MOVERS))
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_chunks)


def fly_chunks(arguments: argparse.Namespace) -> None:
    """Fly the chunks that the table lacks."""
    chunks = range(-(-arguments.flights // CHUNK))
    keys = (
        (mover, sha256_of(mover), system, map, str(chunk))
        for chunk, system, map, mover in itertools.product(
            chunks, arguments.systems, MAPS, arguments.movers
        )
    )
    TABLE.fly_missing(keys, row_of, arguments.workers)


if __name__ == "__main__":
    main()
