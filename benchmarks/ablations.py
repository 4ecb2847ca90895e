"""What each part of ``garl`` is worth: the search without it, on a fast stand-in.

The system under test is a pilot that knows the marker's place and avoids nothing: it needs no
camera, so a search of 400 flights takes three quarters of a minute.  Objects walk to random places.
``python -m benchmarks.ablations`` flies what ``docs/ablations.csv`` lacks; ``--report`` prints the
table.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.adversary.pilots import StraightPilot
from pytest_garl.adversary.policies import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search import garl
from pytest_garl.search.child import THREADS
from pytest_garl.search.method import Flown, Method, Plan
from pytest_garl.search.methods import find_method
from pytest_garl.search.nsga2 import Matrix, Nsga2
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import farthest_from_nearest, local_steps, property_mutation
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge, undecided
from pytest_garl.verdicts.metrics import share_interval, top_k
from pytest_garl.verdicts.moments import closest_call
from pytest_garl.verdicts.serialise import from_dict, to_dict
from pytest_garl.verdicts.verdict import Limits

FILE = Path("docs/ablations.csv")
MAPS = ("court", "lawn")
BUDGET, POPULATION = 400, 20
FIELDS = ("variant", "seed", "map", "budget", "violations", "top10", "signatures")


def plain_threat(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Threat that nobody shares, and diversity."""
    return np.column_stack([[threat(item.result) for item in flown], diversity(chromosomes)])


def only_far(rows: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """No small steps."""
    return property_mutation(rows, lower, upper, rng, choose=farthest_from_nearest)


def papers_candidates(
    rows: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator
) -> Matrix:
    """Small steps, and the paper's candidate rule instead of maximin."""
    near = local_steps(rows, lower, upper, rng)
    far = property_mutation(rows, lower, upper, rng)
    return np.where((rng.random(len(rows)) < 0.5)[:, None], near, far)


def variant(
    objectives: Any = None, mutation: Any = None, immigrants: float = garl.IMMIGRANTS
) -> Any:
    """Return garl with one part replaced."""

    def method(plan: Plan) -> Method:
        return Nsga2(
            "garl",
            plan,
            objectives or garl.objectives,
            2,
            mutation or garl.mutation,
            immigrants=immigrants,
        )

    return method


VARIANTS: dict[str, Callable[[Plan], Method]] = {
    "garl": find_method("garl"),
    "threat not shared": variant(objectives=plain_threat),
    "no small steps": variant(mutation=only_far),
    "paper's candidates": variant(mutation=papers_candidates),
    "no immigrants": variant(immigrants=0.0),
    "garl-paper": find_method("garl-paper"),
    "random": find_method("random"),
}


def fly_one(scenario: Scenario) -> dict[str, Any]:
    """Return the result of one flight, as a ledger holds it."""
    flight = fly(scenario, StraightPilot, policy_spec("waypoint"))
    return {
        "outcome": flight.outcome,
        "final_distance_m": flight.final_distance_m,
        "elapsed_s": flight.elapsed_s,
        "undecided": undecided(flight),
        "closest_call": closest_call(flight),
        "verdict": to_dict(judge(flight, Limits())),
    }


def search(name: str, seed: int, map: str, pool: Executor) -> dict[str, Any]:
    """Run one search to the end of its budget."""
    place = load_map(map)
    plan = Plan(map=place, genome=genome_for(place), seed=seed, population=POPULATION)
    method, verdicts = VARIANTS[name](plan), []
    for _ in range(BUDGET // POPULATION):
        scenarios = method.ask()
        results = list(pool.map(fly_one, scenarios))
        method.tell([Flown(scenario=s, result=r) for s, r in zip(scenarios, results, strict=True)])
        verdicts += [from_dict(result["verdict"]) for result in results]
    return {
        "variant": name,
        "seed": seed,
        "map": map,
        "budget": BUDGET,
        "violations": sum(verdict.paper_violation for verdict in verdicts),
        "top10": top_k(verdicts) or "",
        "signatures": len({each.signature for each in verdicts if each.paper_violation}),
    }


def report(rows: list[dict[str, str]]) -> str:
    """Return a Markdown table over both maps and all seeds."""
    lines = [
        "| variant | searches | violations | Top-10 (mean) | signatures (mean) |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name in VARIANTS:
        own = [row for row in rows if row["variant"] == name]
        if not own:
            continue
        count, total = (sum(int(row[key]) for row in own) for key in ("violations", "budget"))
        low, high = share_interval(count, total)
        # A search that found fewer than ten counts as one more than its budget.
        tops = np.mean([int(row["top10"] or BUDGET + 1) for row in own])
        kinds = np.mean([int(row["signatures"]) for row in own])
        lines.append(
            f"| {name} | {len(own)} | {100 * count / total:.1f} % "
            f"[{100 * low:.1f}, {100 * high:.1f}] | {tops:.0f} | {kinds:.1f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Fly what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--seeds", type=int, nargs="+", default=[100, 101, 102])
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS))
    arguments = parser.parse_args()
    known = list(csv.DictReader(FILE.open())) if FILE.exists() else []
    if arguments.report:
        print(report(known))
        return
    done = {(row["variant"], int(row["seed"]), row["map"]) for row in known}
    os.environ.update(THREADS)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for seed in arguments.seeds:
            for map in MAPS:
                for name in arguments.variants:
                    if (name, seed, map) not in done:
                        _append(search(name, seed, map, pool))


def _append(row: dict[str, Any]) -> None:
    new = not FILE.exists()
    with FILE.open("a", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        if new:
            writer.writeheader()
        writer.writerow(row)
    print(", ".join(f"{name} {value}" for name, value in row.items()), flush=True)


if __name__ == "__main__":
    main()
