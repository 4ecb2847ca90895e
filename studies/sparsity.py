"""Sparse scenarios against dense ones, in which everything in the domain ``field`` acts.

``python -m studies.sparsity`` flies OpenCV-MLS on the lawn with random search and ``garl``, once
with each way of drawing.  It keeps every flight in ``.garl/sparsity.jsonl``, so that an
interrupted search goes on after its last generation, and every finished search in
``docs/sparsity.csv``; ``--report`` prints the table.  Delete the flights when the simulator or the
system has changed.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import json
import math
import os
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.adversary.catalogue import DEFAULT_POLICY, policy_spec
from pytest_garl.adversary.domain_policy import policy_in
from pytest_garl.execution.flight import judged
from pytest_garl.execution.result import FlightResult, parse_result
from pytest_garl.experiments.measure import limits_text
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.genes import ON_ABOVE, Genome
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.catalogue import make_method
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from studies.table import Key, ResultTable, Row, run_study, share

MAP = load_map("lawn")
DOMAIN = domain_named("field")
POPULATION = 20
DRAWINGS, METHODS = ("sparse", "dense"), ("random", "garl")
FLIGHTS = Path(".garl/sparsity.jsonl")
TABLE = ResultTable(
    file=Path("docs/sparsity.csv"),
    columns=(
        "drawing",
        "method",
        "budget",
        "seed",
        "landed",
        "excused",
        "violations",
        "signatures",
        "active",
        "first",
        "limits",
    ),
    key=("drawing", "method", "budget", "seed"),
)


@dataclass(slots=True)
class Flown:
    """The results of flights by the text of their scenario, kept in a file line by line."""

    file: Path
    results: dict[str, FlightResult]

    @classmethod
    def read(cls, file: Path) -> Flown:
        """Return what is in the file; a line that an interruption cut short is left out."""
        results = {}
        lines = file.read_text().splitlines(keepends=True) if file.exists() else []
        for line in lines:
            if line.endswith("\n"):
                scenario, result = json.loads(line)
                results[scenario] = parse_result(result)
        if lines and not lines[-1].endswith("\n"):
            file.write_text("".join(lines[:-1]))
        return cls(file, results)

    def fly(self, scenarios: Sequence[Scenario], pool: Executor) -> list[FlightResult]:
        """Return the results of all; fly those that are missing."""
        texts = {dump_scenario(each): each for each in scenarios}
        missing = {text: each for text, each in texts.items() if text not in self.results}
        self.file.parent.mkdir(parents=True, exist_ok=True)
        for text, result in zip(missing, pool.map(fly_one, missing.values()), strict=True):
            self.results[text] = result
            with self.file.open("a") as file:
                file.write(json.dumps([text, result.dumps()]) + "\n")
        return [self.results[text] for text in texts]


def genome_for_drawing(drawing: str) -> Genome:
    """Return the genome of the domain, sparse or dense."""
    return genome_of(DOMAIN, MAP, is_dense=drawing == "dense")


def fly_one(scenario: Scenario) -> FlightResult:
    """Return the result of one flight."""
    import cv2

    from landing_systems.opencv_mls import OpenCvLandingSystem

    cv2.setNumThreads(1)
    npcs = policy_spec(policy_in(DOMAIN, DEFAULT_POLICY))
    return judged(fly(scenario, OpenCvLandingSystem, npcs, map=MAP), DEFAULT_LIMITS)


def active_count(scenario: Scenario, genome: Genome) -> int:
    """Return how many of the genes that may rest act in a scenario."""
    row = dict(zip(genome.keys, encode(scenario, genome), strict=True))
    return sum(row[gene.properties[0].key] > ON_ABOVE for gene in genome.genes if gene.is_optional)


def search(key: Key, pool: Executor, flown: Flown) -> dict[str, Any]:
    """Fly one search; return its row."""
    drawing, name, budget, seed = key
    genome = genome_for_drawing(drawing)
    size = min(POPULATION, int(budget))
    plan = SearchPlan(map=MAP, genome=genome, seed=int(seed), population=size)
    method, results, counts = make_method(name, plan), list[FlightResult](), list[int]()
    while len(results) < int(budget):
        scenarios = list(method.ask())[: int(budget) - len(results)]
        found = flown.fly(scenarios, pool)
        results += found
        counts += [active_count(each, genome) for each in scenarios]
        violations = sum(each.verdict.violation for each in results)
        print(
            f"{drawing}, {name}, seed {seed}: {len(results)} flights, {violations} violations",
            flush=True,
        )
        if method.learns and len(results) < int(budget):
            pairs = zip(scenarios, found, strict=True)
            method.tell([FlownScenario(scenario=each, result=r) for each, r in pairs])
    fails = [each.verdict.violation for each in results]
    failing = [count for count, fail in zip(counts, fails, strict=True) if fail]
    return {
        **dict(zip(TABLE.key, key, strict=True)),
        "landed": sum(each.verdict.completed for each in results),
        "excused": sum(each.verdict.no_landing in ("excused", "blocked") for each in results),
        "violations": sum(fails),
        "signatures": len({each.signature for each in results if each.verdict.violation}),
        "active": f"{np.mean(failing):.2f}" if failing else "",
        "first": fails.index(True) + 1 if failing else "",
        "limits": limits_text(DEFAULT_LIMITS),
    }


def report(rows: list[Row]) -> str:
    """Return a Markdown table: means over searches, shares of all their flights."""
    lines = [
        "| scenarios | method | searches of | landed | excused or blocked | violations "
        "| kinds of violations | active when failing | flights to the first |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    budgets = sorted({row["budget"] for row in rows}, key=int)
    for budget, drawing, method in itertools.product(budgets, DRAWINGS, METHODS):
        own = [
            row
            for row in rows
            if tuple(row[name] for name in TABLE.key[:3]) == (drawing, method, budget)
        ]
        if not own:
            continue
        flights = int(budget) * len(own)
        # A search without violations counts as its budget and one more.
        first = [float(row["first"] or int(budget) + 1) for row in own]
        failing = [(float(row["active"]), int(row["violations"])) for row in own if row["active"]]
        total = sum(count for _, count in failing)
        active = sum(mean * count for mean, count in failing) / total if total else math.nan
        cells = (
            drawing,
            method,
            f"{len(own)} × {budget}",
            *(
                _share(method, sum(int(row[name]) for row in own), flights)
                for name in ("landed", "excused", "violations")
            ),
            f"{np.mean([int(row['signatures']) for row in own]):.1f}",
            f"{active:.1f}" if total else "–",
            f"{np.mean(first):.1f}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _share(method: str, count: int, total: int) -> str:
    """Return a percentage; with an interval only if no flight depends on another."""
    return share(count, total) if method == "random" else f"{100 * count / total:.1f} %"


def fly_searches(arguments: argparse.Namespace) -> None:
    """Fly the searches that the table lacks."""
    keys = (
        (drawing, method, str(arguments.budget), seed)
        for seed, method, drawing in itertools.product(arguments.seeds, METHODS, DRAWINGS)
    )
    run = functools.partial(search, flown=Flown.read(FLIGHTS))
    TABLE.fly_missing(keys, run, arguments.workers)


def main() -> None:
    """Fly the missing searches, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--budget", type=int, default=60, help="flights per search")
    parser.add_argument("--seeds", nargs="+", default=["0", "1", "2", "3", "4"])
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    run_study(parser, TABLE, report, fly_searches)


if __name__ == "__main__":
    main()
