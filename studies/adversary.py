"""Who steers the objects, in full flights: collisions, blocked landings, violations.

``python -m studies.adversary`` flies what ``docs/adversary.csv`` lacks, fifty flights at a time
of each mover, landing system and map, and can be stopped and started again at any time;
``--report`` prints the table of what is there.  Scenarios are fresh random ones in clear weather,
the same for every mover.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.scenarios.genes import WEATHER, genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import propose
from pytest_garl.simulation.npc_policy import PolicySpec
from studies.oracle import oracle_spec
from studies.rows import append, read, share

FILE = Path("docs/adversary.csv")
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
FIELDS = (
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
)
KEY = FIELDS[:5]


def spec_of(mover: str) -> PolicySpec:
    """Return a mover's specification."""
    return oracle_spec() if mover == "oracle" else policy_spec(mover)


def sha256_of(mover: str) -> str:
    """Return the start of the hash of a learned mover's weights; nothing for the others."""
    return spec_of(mover).sha256[:16]


def scenarios(map: str, chunk: int) -> list[Scenario]:
    """Return a chunk's scenarios: random, repaired, in clear weather."""
    place = load_map(map)
    clear = {f"environment.{name}": 0.0 for name, _ in WEATHER}
    return [each.replace(clear) for each in propose(place, genome_for(place), SEED, chunk, CHUNK)]


def fly_one(job: tuple[Scenario, str, str]) -> tuple[str, str, bool]:
    """Return a flight's outcome, the kind of the object that it hit, and its verdict."""
    import cv2

    from landing_systems.opencv_mls import OpenCvLandingSystem
    from pytest_garl.simulation.fly import fly
    from pytest_garl.verdicts.judge import judge
    from pytest_garl.verdicts.verdict import Limits
    from studies.avoiding import AvoidingLandingSystem

    cv2.setNumThreads(1)
    scenario, mover, system = job
    made: Any = {"opencv": OpenCvLandingSystem, "avoiding": AvoidingLandingSystem}[system]
    flight = fly(scenario, made, spec_of(mover))
    hit = flight.outcome == "collision" and flight.contacts[-1].body_class == "dynamic"
    verdict = judge(flight, Limits())
    return flight.outcome, flight.contacts[-1].kind if hit else "", verdict.paper_violation


def row_of(mover: str, system: str, map: str, chunk: int, pool: Any) -> dict[str, Any]:
    """Fly one chunk."""
    jobs = [(scenario, mover, system) for scenario in scenarios(map, chunk)]
    ends = list(pool.map(fly_one, jobs))
    hits = Counter(kind for _, kind, _ in ends if kind)
    return {
        "mover": mover,
        "sha256": sha256_of(mover),
        "system": system,
        "map": map,
        "chunk": chunk,
        "flights": len(ends),
        "collided": hits.total(),
        **{kind: hits[kind] for kind in KINDS},
        "blocked": sum(outcome in ("aborted", "not_landed") for outcome, _, _ in ends),
        "violations": sum(violation for _, _, violation in ends),
        "crashed": sum(outcome == "crashed" for outcome, _, _ in ends),
    }


def report(rows: list[dict[str, str]]) -> str:
    """Return a Markdown table: per system, both maps and each, a row for each mover."""
    lines = [
        "| system | map | mover | flights | collided | who (p / d / b) | blocked | violations |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for system in SYSTEMS:
        for map in ("both", *MAPS):
            for mover in MOVERS:
                # Rows of weights that are not shipped any more count for nothing.
                key = (system, mover, sha256_of(mover))
                names = ("system", "mover", "sha256")
                own = [row for row in rows if tuple(row[name] for name in names) == key]
                own = [row for row in own if map in ("both", row["map"])]
                if not own:
                    continue
                total = {name: sum(int(row[name]) for row in own) for name in FIELDS[5:]}
                cells = [
                    share(total[name], total["flights"])
                    for name in ("collided", "blocked", "violations")
                ]
                kinds = " / ".join(str(total[kind]) for kind in KINDS)
                lines.append(
                    f"| {system} | {map} | {mover} | {total['flights']} | {cells[0]} | {kinds} "
                    f"| {cells[1]} | {cells[2]} |"
                )
    return "\n".join(lines)


def main() -> None:
    """Fly what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--flights", type=int, default=150, help="per mover, system and map")
    parser.add_argument("--movers", nargs="+", default=list(MOVERS))
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    known = read(FILE)
    if arguments.report:
        print(report(known))
        return
    done = {tuple(row[name] for name in KEY) for row in known}
    cpu_dispatch.pin()
    with ProcessPoolExecutor(arguments.workers) as pool:
        for chunk in range(-(-arguments.flights // CHUNK)):
            for system in arguments.systems:
                for map in MAPS:
                    for mover in arguments.movers:
                        key = (mover, sha256_of(mover), system, map, str(chunk))
                        if key not in done:
                            append(FILE, FIELDS, [row_of(mover, system, map, chunk, pool)])


if __name__ == "__main__":
    main()
