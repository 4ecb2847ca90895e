"""What the parts of ``garl`` are worth: the search without them, and with others instead.

The system under test is a pilot that knows the marker's place, climbs away from what it could see
below, and goes home where it has not landed after a minute: it needs no camera, so a search of 400
flights takes a minute or two.  Objects are steered as each method has it.
``python -m studies.ablations`` flies what ``docs/ablations.csv`` lacks; ``--report`` prints the
table.
"""

from __future__ import annotations

import argparse
import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from pytest_garl import cpu_dispatch
from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.adversary.training.uav_models import AvoidingPilot
from pytest_garl.execution.flight import judged
from pytest_garl.execution.result import FlightResult
from pytest_garl.landing_system import Abort, Command, Observation
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.catalogue import find_method
from pytest_garl.search.method import Flown, Method, SearchPlan
from pytest_garl.search.methods.garl import Garl, GarlParameters
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.paper_metrics import mean_distance, top_k
from pytest_garl.verdicts.verdict import PAPER_LIMITS
from studies.rows import append, read

FILE = Path("docs/ablations.csv")
MAPS = ("court", "lawn")
BUDGET, POPULATION = 400, 20
PATIENCE_S = 60.0
"""When the pilot goes home: twice as long as MM-MLS takes to land."""
FIELDS = ("variant", "seed", "map", "budget", "violations", "top10", "signatures", "distance")


def found(result: FlightResult) -> str:
    """Name the cell by the violation alone: near misses of all kinds share one."""
    return result.signature or result.outcome


def one(result: FlightResult) -> str:
    """Name one cell for all: what comes nearest to a violation is bred from, whatever it is."""
    return ""


def half_exploring(plan: SearchPlan) -> Method:
    """Return ``garl`` with half of its scenarios without parents."""
    return Garl(plan, GarlParameters(explore_share=0.5))


def garl_with(**parameters: Any) -> Callable[[SearchPlan], Method]:
    """Return the factory of ``garl`` with other parameters."""
    return functools.partial(Garl, parameters=GarlParameters(**parameters))


VARIANTS: dict[str, Callable[[SearchPlan], Method]] = {
    "garl": find_method("garl"),
    "one cell": garl_with(cell=one),
    "cells of violations only": garl_with(cell=found),
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
POLICIES = {"garl-paper": "dqn-paper", "random": "waypoint"}
"""Who moves the objects; ``dqn`` where nothing is said."""


class Pilot(AvoidingPilot):
    """Avoids what is below, and does not wait for ever."""

    def step(self, observation: Observation) -> Command:
        """Fly, or go home."""
        return Abort() if observation.time_s > PATIENCE_S else super().step(observation)


def fly_one(scenario: Scenario, policy: str) -> FlightResult:
    """Return the result of one flight."""
    return judged(fly(scenario, Pilot, policy_spec(policy)), PAPER_LIMITS)


def search(name: str, seed: int, map: str, pool: Executor) -> dict[str, Any]:
    """Run one search to the end of its budget."""
    place = load_map(map)
    plan = SearchPlan(map=place, genome=genome_for(place), seed=seed, population=POPULATION)
    flown = functools.partial(fly_one, policy=POLICIES.get(name, "dqn"))
    method, verdicts, chromosomes = VARIANTS[name](plan), [], []
    for _ in range(BUDGET // POPULATION):
        scenarios = method.ask()
        results = list(pool.map(flown, scenarios))
        method.tell([Flown(scenario=s, result=r) for s, r in zip(scenarios, results, strict=True)])
        verdicts += [result.verdict for result in results]
        chromosomes += [plan.genome.normalise(encode(each, plan.genome)) for each in scenarios]
    return {
        "variant": name,
        "seed": seed,
        "map": map,
        "budget": BUDGET,
        "violations": sum(verdict.paper_violation for verdict in verdicts),
        "top10": top_k(verdicts) or "",
        "signatures": len({each.signature for each in verdicts if each.paper_violation}),
        "distance": f"{mean_distance(np.array(chromosomes)):.3f}",
    }


def report(rows: list[dict[str, str]]) -> str:
    """Return a Markdown table: means over searches, the flights of one being no sample."""
    lines = [
        "| variant | searches | violations, % | Top-10 | signatures | distance |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name in VARIANTS:
        own = [row for row in rows if row["variant"] == name]
        if not own:
            continue
        # A search that found fewer than ten counts as one more than its budget.
        figures = (
            [100 * int(row["violations"]) / int(row["budget"]) for row in own],
            [float(row["top10"] or BUDGET + 1) for row in own],
            [float(row["signatures"]) for row in own],
            [float(row["distance"]) for row in own],
        )
        cells = " | ".join(_mean(values) for values in figures)
        lines.append(f"| {name} | {len(own)} | {cells} |")
    return "\n".join(lines)


def _mean(values: Sequence[float]) -> str:
    """Return the mean with its 95 % interval (Student's t), which says something from three on."""
    mean = float(np.mean(values))
    if len(values) < 3:
        return f"{mean:.3g}"
    error = float(np.std(values, ddof=1)) / len(values) ** 0.5
    half = float(t.ppf(0.975, len(values) - 1)) * error
    return f"{mean:.3g} ± {half:.2g}"


def main() -> None:
    """Fly what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--seeds", type=int, nargs="+", default=[100, 101, 102])
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS))
    arguments = parser.parse_args()
    known = read(FILE)
    if arguments.report:
        print(report(known))
        return
    done = {(row["variant"], int(row["seed"]), row["map"]) for row in known}
    cpu_dispatch.pin()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for seed in arguments.seeds:
            for map in MAPS:
                for name in arguments.variants:
                    if (name, seed, map) not in done:
                        append(FILE, FIELDS, [search(name, seed, map, pool)])


if __name__ == "__main__":
    main()
