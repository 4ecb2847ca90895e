"""NPCs of each grade in full flights: who is hit, who gives up, beside unlearned rivals.

``python -m lab.grades`` flies the flights that ``docs/grades.csv`` lacks, in chunks of ten for
each mover, number of NPCs, landing system and map; it can be interrupted and started again at any
time.  ``--report`` prints the tables.  The scenarios are random stories of the domain `field` in
clear weather, everything else nominal, and the same for every mover: only the grade differs, or the
mind of the NPCs.  With one NPC the types take turns.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import os
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from lab.oracle import oracle_spec
from lab.table import Key, ResultTable, Row, run_study, share
from pytest_garl.npcs.interference import Interfering, Mind
from pytest_garl.npcs.learned import LearnedMind, shipped
from pytest_garl.npcs.minds import Direct, Intercepting, ToMarker
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import OFF, ON
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, STORY
from pytest_garl.scenarios.validity import repair
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Verdict

SEED = 2810
"""No training and no other study uses it."""
CHUNK = 10
UNLEARNED: dict[str, Callable[[], Mind]] = {
    "direct": Direct,
    "intercepting": Intercepting,
    "to-marker": ToMarker,
}
MINDS = ("learned", *UNLEARNED)
"""Minds of the grades that see the UAV in part; the first one is what ``garl train`` wrote."""
GRADED = tuple(f"{grade} {mind}" for grade in ("curious", "chasing") for mind in MINDS)
MOVERS = ("absent", "careless", *GRADED, "hostile", "waypoint", "dqn-paper")
RIVALS = ("oracle",)
"""Movers that fly only if ``--movers`` names them; ``docs/grades.csv`` has no rows of them."""
SYSTEMS = ("opencv", "mm")
MAPS = ("court", "lawn")
COUNTS = ("one", "all")
KINDS = ("person", "child", "dog", "bird")
TABLE = ResultTable(
    file=Path("docs/grades.csv"),
    columns=(
        "mover",
        "npcs",
        "system",
        "map",
        "chunk",
        "flights",
        "landed",
        "collided",
        *KINDS,
        "gave_up",
        "needless",
        "distance_decided",
        "time_decided",
        "violations",
    ),
    key=("mover", "npcs", "system", "map", "chunk"),
)


def spec_of(mover: str) -> PolicySpec:
    """Return the specification of a mover."""
    if mover == "absent":
        return policy_spec("stationary")
    if mover == "oracle":
        return oracle_spec()
    grade, _, mind = mover.partition(" ")
    if not mind:
        return policy_spec(grade)
    return PolicySpec(
        name=mover,
        factory=f"{__name__}:{interfering.__name__}",
        arguments=(("grade", grade), ("mind", mind)),
    )


def interfering(grade: str, mind: str) -> Interfering:
    """Return the NPC policy of a grade with a learned or an unlearned mind."""
    if mind == "learned":
        return Interfering(grade, LearnedMind(shipped(grade)))
    return Interfering(grade, UNLEARNED[mind]())


def scenario_of(map_name: str, npcs: str, number: int, grade: str) -> Scenario:
    """Return one scenario: everything nominal but the marker's place and the stories of NPCs."""
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map, is_dense=True)
    rng = np.random.default_rng([SEED, MAPS.index(map_name), number])
    drawn = dict(zip(genome.keys, genome.lower, strict=True))
    drawn |= {each.key: float(rng.uniform(each.low, each.high)) for each in genome.properties}
    names = [name for name, _ in map.present_objects]
    kept = {"all": names, "one": [names[number % len(names)]], "none": []}[npcs]
    row = []
    for gene in genome.genes:
        is_npc = gene.name in names
        for item in gene.properties:
            is_kept = gene.name in kept or item.key.startswith("marker.")
            value = drawn[item.key] if is_kept else item.nominal
            if item.key == gene.properties[0].key and gene.is_optional:
                value = ON if gene.name in kept else OFF
            if is_npc and item.key.endswith(".grade"):
                value = min(item.high, float(GRADES.index(grade)))
            row.append(value)
    return repair(decode(np.array(row), genome, map=map_name, seed=number), map)


def fly_one(job: tuple[str, str, str, str, int]) -> tuple[Verdict, str]:
    """Return a flight's verdict and the kind of the object that it hit."""
    import cv2

    from landing_systems.mm_mls import MultiModuleLandingSystem
    from landing_systems.opencv_mls import OpenCvLandingSystem
    from pytest_garl.simulation.fly import fly
    from pytest_garl.verdicts.judge import judge

    cv2.setNumThreads(1)
    mover, npcs, system, map, number = job
    made: Any = {"opencv": OpenCvLandingSystem, "mm": MultiModuleLandingSystem}[system]
    grade = mover.partition(" ")[0]
    scenario = scenario_of(
        map,
        "none" if mover == "absent" else npcs,
        number,
        grade if grade in GRADES[:3] else GRADES[0],
    )
    if grade not in GRADES[:3]:
        scenario = without_stories(scenario)
    flight = fly(scenario, made, spec_of(mover))
    hit = flight.outcome == "collision" and flight.contacts[-1].body_class == "dynamic"
    return judge(flight, DEFAULT_LIMITS), flight.contacts[-1].kind if hit else ""


def without_stories(scenario: Scenario) -> Scenario:
    """Return the scenario without stories, so that its policy alone says what NPCs do."""
    genes = tuple(pair for pair in scenario.genes if pair[0].partition(".")[2] not in STORY)
    return dataclasses.replace(scenario, genes=genes)


def row_of(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly one chunk; return its row."""
    mover, npcs, system, map, chunk = key
    numbers = range(int(chunk) * CHUNK, (int(chunk) + 1) * CHUNK)
    ends = list(pool.map(fly_one, [(mover, npcs, system, map, number) for number in numbers]))
    verdicts = [verdict for verdict, _ in ends]
    hits = Counter(kind for _, kind in ends if kind)
    return {
        **dict(zip(TABLE.key, key, strict=True)),
        "flights": len(ends),
        "landed": sum(verdict.completed for verdict in verdicts),
        "collided": hits.total(),
        **{kind: hits[kind] for kind in KINDS},
        "gave_up": sum(verdict.outcome in ("gave_up", "not_landed") for verdict in verdicts),
        "needless": sum(verdict.no_landing == "needless" for verdict in verdicts),
        "distance_decided": sum(_is_decided(verdict, "distance") for verdict in verdicts),
        "time_decided": sum(_is_decided(verdict, "time") for verdict in verdicts),
        "violations": sum(verdict.violation for verdict in verdicts),
    }


def _is_decided(verdict: Verdict, name: Any) -> bool:
    margin = verdict.margin(name)
    return margin is not None and margin.decided


def report(rows: list[Row]) -> str:
    """Return a Markdown table: a row for each system, number of NPCs and mover, both maps."""
    lines = [
        "| system | NPCs | mover | flights | collided | who (p / c / d / b) | gave up | landed |",
        "| --- | --- | --- | ---: | --- | --- | --- | --- |",
    ]
    for system, npcs, mover in itertools.product(SYSTEMS, COUNTS, (*MOVERS, *RIVALS)):
        own = [
            row
            for row in rows
            if (row["system"], row["npcs"], row["mover"]) == (system, npcs, mover)
        ]
        if not own:
            continue
        total = {
            name: sum(int(row[name]) for row in own)
            for name in ("flights", "collided", "gave_up", "landed", *KINDS)
        }
        flights = total["flights"]
        collided, gave_up, landed = (
            share(total[name], flights) for name in ("collided", "gave_up", "landed")
        )
        who = " / ".join(str(total[kind]) for kind in KINDS)
        lines.append(
            f"| {system} | {npcs} | {mover} | {flights} | {collided} | {who} | {gave_up} "
            f"| {landed} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Fly the missing flights, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=100, help="per cell and map; default 100")
    parser.add_argument("--movers", nargs="+", choices=(*MOVERS, *RIVALS), default=list(MOVERS))
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS))
    parser.add_argument("--npcs", nargs="+", default=list(COUNTS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_chunks)


def fly_chunks(arguments: argparse.Namespace) -> None:
    """Fly the chunks that the table lacks; all cells grow alike."""
    chunks = range(-(-arguments.flights // CHUNK))
    keys = (
        (mover, npcs, system, map, str(chunk))
        for chunk, npcs, system, map, mover in itertools.product(
            chunks, arguments.npcs, arguments.systems, MAPS, arguments.movers
        )
        if not (mover == "absent" and npcs == "all")
    )
    TABLE.fly_missing(keys, row_of, arguments.workers)


if __name__ == "__main__":
    main()
