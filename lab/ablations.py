"""The worth of evolution in ``garl``: searches without it, and with a model that knows nothing.

The searches fly the stand-in of ``lab/stand_in.py`` in the domain `field`, where 400 flights
take seconds.  ``python -m lab.ablations`` flies the searches that ``docs/results/ablations.csv``
lacks; ``--report`` prints the table, which compares each variant with ``garl`` seed by seed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from lab.arms import arm_named
from lab.stand_in import stand_in
from lab.stand_in_way import ORDINARY, STURDY
from lab.table import Key, ResultTable, Row
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.verdicts.kinds import hill_number

MAPS = ("court", "lawn")
BUDGET, POPULATION = 400, 20
EARLY, MIDDLE = 100, 200
SEEDS = tuple(str(seed) for seed in range(230, 236))
"""The search was developed on seeds 200 to 211, and on those from 300 on."""
LANDINGS = {"ordinary": ORDINARY, "sturdy": STURDY}
LEVEL = 0.90
TABLE = ResultTable(
    file=Path("docs/results/ablations.csv"),
    columns=("variant", "landing", "seed", "map", "budget", "early", "middle", "first", "kinds"),
    key=("variant", "landing", "seed", "map"),
)


VARIANTS = ("garl", "exploring+", "shuffled", "random")
"""The arms that are flown."""


def search(key: Key, pool: Executor) -> dict[str, Any]:
    """Run one search in another process; return its row."""
    return pool.submit(run_search, key).result()


def run_search(key: Key) -> dict[str, Any]:
    """Run one search; return its row."""
    name, landing, seed, map_name = key
    map = load_map(map_name)
    genome = genome_of(domain_named("field"), map)
    plan = SearchPlan(map=map, genome=genome, seed=int(seed), flights=BUDGET, population=POPULATION)
    method, found = arm_named(name).make(plan), list[str]()
    for _ in range(BUDGET // POPULATION):
        scenarios = method.ask()
        results = [stand_in(each, map, LANDINGS[landing]) for each in scenarios]
        pairs = zip(scenarios, results, strict=True)
        if method.learns:
            method.tell([FlownScenario(scenario=each, result=result) for each, result in pairs])
        found += [result.signature for result in results]
    counts = Counter(filter(None, found))
    return {
        "variant": name,
        "landing": landing,
        "seed": seed,
        "map": map_name,
        "budget": BUDGET,
        "early": len(set(filter(None, found[:EARLY]))),
        "middle": len(set(filter(None, found[:MIDDLE]))),
        "first": next((i for i, each in enumerate(found, start=1) if each), BUDGET),
        "kinds": json.dumps(dict(sorted(counts.items()))),
    }


MEASURES: dict[str, Callable[[Row], float]] = {
    "kinds": lambda row: float(len(_counts(row))),
    f"kinds in {MIDDLE} flights": lambda row: float(row["middle"]),
    f"kinds in {EARLY} flights": lambda row: float(row["early"]),
    "effective kinds": lambda row: hill_number(_counts(row), 1),
    "first violation": lambda row: float(row["first"]),
    "violations, %": lambda row: 100 * sum(_counts(row)) / int(row["budget"]),
}
COMPARED = 4
"""The first so many measures are compared with those of ``garl``."""


def _counts(row: Row) -> list[int]:
    return list(json.loads(row["kinds"]).values())


def report(rows: list[Row]) -> str:
    """Return a table in Markdown for each landing."""
    of = {name: [row for row in rows if row["landing"] == name] for name in LANDINGS}
    return "\n\n".join(f"{name}:\n\n{_table(own)}" for name, own in of.items() if own)


def _table(rows: list[Row]) -> str:
    """Return a table of means, and of differences to ``garl`` over seeds and maps."""
    names = list(MEASURES)
    heads = [*(f"{name}, less garl's" if i < COMPARED else name for i, name in enumerate(names))]
    cells = [
        part
        for index, name in enumerate(names)
        for part in ((name, heads[index]) if index < COMPARED else (name,))
    ]
    lines = [
        f"| variant | searches | {' | '.join(cells)} |",
        f"| --- | ---: {'| ---: ' * len(cells)}|",
    ]
    of_garl = {(row["seed"], row["map"]): row for row in rows if row["variant"] == "garl"}
    for variant in dict.fromkeys(row["variant"] for row in rows):
        own = [row for row in rows if row["variant"] == variant]
        texts = []
        for index, measure in enumerate(MEASURES.values()):
            values = [measure(row) for row in own]
            texts.append(f"{np.mean(values):.1f}")
            if index < COMPARED:
                rivals = [of_garl.get((row["seed"], row["map"])) for row in own]
                pairs = zip(values, rivals, strict=True)
                differences = [a - measure(b) for a, b in pairs if b]
                texts.append("–" if variant == "garl" else interval(differences))
        lines.append(f"| {variant} | {len(own)} | {' | '.join(texts)} |")
    return "\n".join(lines)


def interval(differences: Sequence[float]) -> str:
    """Return the mean of paired differences with its interval (Student's t)."""
    if len(differences) < 3:
        return "–"
    error = float(np.std(differences, ddof=1)) / len(differences) ** 0.5
    half = float(t.ppf((1 + LEVEL) / 2, len(differences) - 1)) * error
    return f"{np.mean(differences):+.1f} ± {half:.1f}"


def main() -> None:
    """Fly the missing searches, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", default=list(SEEDS))
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), help="arms")
    parser.add_argument("--landings", nargs="+", default=list(LANDINGS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--report", action="store_true", help="print the table, fly nothing")
    arguments = parser.parse_args()
    if arguments.report:
        print(report(TABLE.rows()))
        return
    keys = itertools.product(arguments.seeds, MAPS, arguments.landings, arguments.variants)
    TABLE.fly_missing(
        ((name, landing, seed, map) for seed, map, landing, name in keys), search, arguments.workers
    )


if __name__ == "__main__":
    main()
