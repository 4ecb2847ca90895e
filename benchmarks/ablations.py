"""What the parts of ``garl`` are worth: the search without them, and with others instead.

The system under test is a pilot that knows the marker's place and avoids nothing: it needs no
camera, so a search of 400 flights takes three quarters of a minute.  Objects walk to random places.
``python -m benchmarks.ablations`` flies what ``docs/ablations.csv`` lacks; ``--report`` prints the
table.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from pytest_garl.adversary.pilots import StraightPilot
from pytest_garl.adversary.policies import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search import garl
from pytest_garl.search.child import THREADS
from pytest_garl.search.method import Flown, Method, Plan
from pytest_garl.search.methods import find_method
from pytest_garl.search.nsga2 import Matrix, Mutation, Nsga2, Objectives
from pytest_garl.search.objectives import diversity, threat
from pytest_garl.search.operators import (
    MUTATION_PROBABILITY,
    farthest_from_nearest,
    local_steps,
    property_mutation,
)
from pytest_garl.simulation.flight import Flight
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge, undecided
from pytest_garl.verdicts.metrics import top_k
from pytest_garl.verdicts.moments import moment
from pytest_garl.verdicts.serialise import from_dict, to_dict
from pytest_garl.verdicts.verdict import Limits

FILE = Path("docs/ablations.csv")
MAPS = ("court", "lawn")
BUDGET, POPULATION = 400, 20
FIELDS = ("variant", "seed", "map", "budget", "violations", "top10", "signatures")


def plain_threat(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Threat and diversity; nothing remembers which signatures are known."""
    return np.column_stack([[threat(item.result) for item in flown], diversity(chromosomes)])


def niches(chromosomes: Matrix, flown: Sequence[Flown]) -> Matrix:
    """Threat that flights share whose closest call was with the same kind at the same moment.

    The k-th of a niche counts 1/k of its threat, which is 2 for a violation; first come those
    of signatures that no other has.
    """
    spread = diversity(chromosomes)
    results = [item.result for item in flown]
    signatures = [result["verdict"]["signature"] for result in results]
    threats = np.array(
        [2.0 if sign else threat(result) for sign, result in zip(signatures, results, strict=True)]
    )
    known: set[str] = set()
    repeats = np.zeros(len(results), dtype=bool)
    for index in np.argsort(-spread, kind="stable"):
        repeats[index] = signatures[index] in known
        known.add(signatures[index])
    places: Counter[str] = Counter()
    for index in np.lexsort((-spread, repeats, -threats)):
        alike = results[index]["closest_call"] or results[index]["outcome"]
        places[alike] += 1
        threats[index] /= places[alike]
    return np.column_stack([threats, spread])


def only_far(rows: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator) -> Matrix:
    """No local steps."""
    return property_mutation(rows, lower, upper, rng, choose=farthest_from_nearest)


def papers_candidates(
    rows: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator
) -> Matrix:
    """Local steps, and the paper's candidate rule instead of maximin."""
    near = local_steps(rows, lower, upper, rng)
    far = property_mutation(rows, lower, upper, rng)
    return np.where((rng.random(len(rows)) < 0.5)[:, None], near, far)


def steps_of_all_sizes(
    rows: Matrix, lower: Matrix, upper: Matrix, rng: np.random.Generator
) -> Matrix:
    """Local steps from 0.3 % to 10 % of a range, as large as drawn for each chromosome."""
    scale = np.exp(rng.uniform(np.log(0.003), np.log(0.1), (len(rows), 1)))
    steps = rng.normal(0.0, 1.0, rows.shape) * scale * (upper - lower)
    near = np.where(rng.random(rows.shape) < MUTATION_PROBABILITY, rows + steps, rows)
    far = only_far(rows, lower, upper, rng)
    return np.clip(np.where((rng.random(len(rows)) < 0.5)[:, None], near, far), lower, upper)


class Immigrants(Nsga2):
    """A quarter of each generation has no parents (Grefenstette 1992)."""

    def offspring(self, parents: Matrix) -> Matrix:
        """Return children, the last quarter replaced: parents come best first."""
        born = super().offspring(parents)
        for index in range(len(born) - round(0.25 * len(born)), len(born)):
            drawn = self._plan.genome.random(self._rng)
            born[index] = self._valid(drawn, int(self._rng.integers(2**32)))
        return born


def variant(
    objectives: Objectives | None = None,
    mutation: Mutation = garl.mutation,
    search: type[Nsga2] = Nsga2,
) -> Callable[[Plan], Method]:
    """Return garl with parts replaced."""

    def method(plan: Plan) -> Method:
        return search("garl", plan, objectives or garl.Archive().objectives, 2, mutation)

    return method


VARIANTS: dict[str, Callable[[Plan], Method]] = {
    "garl": find_method("garl"),
    "without the archive": variant(objectives=plain_threat),
    "without local steps": variant(mutation=only_far),
    "paper's candidates": variant(mutation=papers_candidates),
    "niches instead of the archive": variant(objectives=niches),
    "with steps of all sizes": variant(mutation=steps_of_all_sizes),
    "with immigrants": variant(search=Immigrants),
    "niches, all sizes, immigrants": variant(niches, steps_of_all_sizes, Immigrants),
    "garl-paper": find_method("garl-paper"),
    "random": find_method("random"),
}


def closest_call(flight: Flight, within_m: float = 3.0) -> str:
    """Name to what the UAV came nearest, and when: "dog:descent"."""
    near = [
        (gap.distance_m, gap.kind, gap.time_s)
        for gap in flight.separations
        if gap.body_class != "ground" and gap.distance_m < within_m
    ]
    if not near:
        return ""
    _, kind, time_s = min(near)
    return f"{kind}:{moment(flight, time_s)}"


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
    """Return a Markdown table: means over searches, the flights of one being no sample."""
    lines = [
        "| variant | searches | violations, % | Top-10 | signatures |",
        "| --- | --- | --- | --- | --- |",
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
        )
        cells = " | ".join(_mean(values) for values in figures)
        lines.append(f"| {name} | {len(own)} | {cells} |")
    return "\n".join(lines)


def _mean(values: Sequence[float]) -> str:
    """Return the mean with its 95 % interval (Student's t)."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return f"{mean:.1f}"
    error = float(np.std(values, ddof=1)) / len(values) ** 0.5
    half = float(t.ppf(0.975, len(values) - 1)) * error
    return f"{mean:.1f} ± {half:.1f}"


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
