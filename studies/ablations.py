"""The worth of each part of ``garl``: searches without the part, or with another in its place.

The system under test is a pilot that knows the marker's position, climbs away from objects below
and gives up after a minute.  It needs no camera, so a search of 400 flights takes a minute or two.
``python -m studies.ablations`` flies the searches that ``docs/ablations.csv`` lacks; ``--report``
prints the table.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.adversary.training.uav_models import AvoidingPilot
from pytest_garl.execution.flight import judged
from pytest_garl.execution.result import FlightResult
from pytest_garl.experiments.measure import limits_text
from pytest_garl.landing_system import Abort, Command, Observation
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.catalogue import default_policy, find_method
from pytest_garl.search.method import FlownScenario, Method, SearchPlan
from pytest_garl.search.methods.garl import Garl, GarlParameters
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.paper_metrics import mean_distance, top_k
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from studies.table import Key, ResultTable, Row, definitions, run_study

MAPS = ("court", "lawn")
BUDGET, POPULATION = 400, 20
PATIENCE_S = 60.0
"""The pilot gives up after this time: twice as long as MM-MLS takes to land."""
TABLE = ResultTable(
    file=Path("docs/ablations.csv"),
    columns=(
        "variant",
        "seed",
        "map",
        "budget",
        "violations",
        "top10",
        "signatures",
        "distance",
        "limits",
        "landed",
        "paper",
        "kinds",
    ),
    key=("variant", "seed", "map"),
)


def found(result: FlightResult) -> tuple[str, ...]:
    """Name the cell by the violation alone: all near misses share a cell."""
    return (result.signature or result.verdict.no_landing or result.outcome,)


def one(result: FlightResult) -> tuple[str, ...]:
    """Put all flights into one cell: the nearest to a violation is bred from."""
    return ("",)


def half_exploring(plan: SearchPlan) -> Method:
    """Return ``garl`` with half of its scenarios without parents."""
    return Garl(plan, GarlParameters(explore_share=0.5))


def garl_with(**parameters: Any) -> Callable[[SearchPlan], Method]:
    """Return the factory of ``garl`` with other parameters."""
    return functools.partial(Garl, parameters=GarlParameters(**parameters))


VARIANTS: dict[str, Callable[[SearchPlan], Method]] = {
    "garl": find_method("garl"),
    "one cell": garl_with(cells=one),
    "cells of violations only": garl_with(cells=found),
    "without exploring": garl_with(explore_share=0.0),
    "half of it exploring": half_exploring,
    "cells in turn": garl_with(learns_cells=False),
    "without aimed steps": garl_with(aimed_share=0.0),
    "without other weather": garl_with(other_weather_share=0.0),
    "without crossover": garl_with(crossover_probability=0.0),
    "without spreading": garl_with(spread_share=0.0),
    "garl-paper": find_method("garl-paper"),
    "random": find_method("random"),
    "random with dqn": find_method("random"),
}


class Pilot(AvoidingPilot):
    """Avoids objects below, and gives up after :data:`PATIENCE_S`."""

    def step(self, observation: Observation) -> Command:
        """Fly, or abort the landing."""
        return Abort() if observation.time_s > PATIENCE_S else super().step(observation)


def fly_one(scenario: Scenario, policy: str) -> FlightResult:
    """Return the result of one flight."""
    return judged(fly(scenario, Pilot, policy_spec(policy)), DEFAULT_LIMITS)


def search(key: Key, pool: Executor) -> dict[str, Any]:
    """Fly one search; return its row."""
    name, seed, map_name = key
    map = load_map(map_name)
    plan = SearchPlan(map=map, genome=genome_for(map), seed=int(seed), population=POPULATION)
    flown = functools.partial(fly_one, policy=default_policy(name))
    method, verdicts, chromosomes = VARIANTS[name](plan), [], []
    for _ in range(BUDGET // POPULATION):
        scenarios = method.ask()
        results = list(pool.map(flown, scenarios))
        method.tell(
            [FlownScenario(scenario=s, result=r) for s, r in zip(scenarios, results, strict=True)]
        )
        verdicts += [result.verdict for result in results]
        chromosomes += [plan.genome.normalise(encode(each, plan.genome)) for each in scenarios]
    return {
        "variant": name,
        "seed": seed,
        "map": map_name,
        "budget": BUDGET,
        "violations": sum(verdict.violation for verdict in verdicts),
        "top10": top_k(verdicts, by_the_paper=False) or "",
        "signatures": len({each.signature for each in verdicts if each.violation}),
        "distance": f"{mean_distance(np.array(chromosomes)):.3f}",
        "limits": limits_text(DEFAULT_LIMITS),
        "landed": sum(verdict.completed for verdict in verdicts),
        "paper": sum(verdict.paper_violation for verdict in verdicts),
        "kinds": len({each.cause for each in verdicts if each.violation}),
    }


def report(rows: list[Row]) -> str:
    """Return a Markdown table of means over searches; flights of one search are no sample."""
    lines = [
        "| variant | searches | landed, % | violations, % | paper's definition, % | definition "
        "| Top-10 | causes | kinds | distance |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, limits in itertools.product(VARIANTS, sorted({row["limits"] for row in rows})):
        own = [row for row in rows if (row["variant"], row["limits"]) == (name, limits)]
        if not own:
            continue
        # Top-10 of a search with fewer than ten violations counts as its budget and one more.
        cells = (
            *(_share(own, column) for column in ("landed", "violations", "paper")),
            definitions(own),
            _mean([float(row["top10"] or BUDGET + 1) for row in own]),
            _mean([float(row["kinds"]) for row in own if row["kinds"]]),
            *(_mean([float(row[column]) for row in own]) for column in ("signatures", "distance")),
        )
        lines.append(f"| {name} | {len(own)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _share(rows: Sequence[Row], column: str) -> str:
    return _mean([100 * int(row[column]) / int(row["budget"]) for row in rows if row[column]])


def _mean(values: Sequence[float]) -> str:
    """Return the mean, from three values on with its 95 % interval (Student's t); – for none."""
    if not values:
        return "–"
    mean = float(np.mean(values))
    if len(values) < 3:
        return f"{mean:.3g}"
    error = float(np.std(values, ddof=1)) / len(values) ** 0.5
    half = float(t.ppf(0.975, len(values) - 1)) * error
    return f"{mean:.3g} ± {half:.2g}"


def main() -> None:
    """Fly the missing searches, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs="+", default=["100", "101", "102"])
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS))
    run_study(parser, TABLE, report, fly_searches)


def fly_searches(arguments: argparse.Namespace) -> None:
    """Fly the searches that the table lacks."""
    keys = itertools.product(arguments.seeds, MAPS, arguments.variants)
    TABLE.fly_missing(((name, seed, map) for seed, map, name in keys), search, os.cpu_count())


if __name__ == "__main__":
    main()
