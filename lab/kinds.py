"""The kinds of violation that a search finds in `field`, against random scenarios of it.

``python -m lab.kinds`` flies the searches that ``docs/kinds.csv`` lacks: 400 flights of each
landing system and seed with ``garl`` and with ``random``, half of the seeds on each map; it can be
interrupted and started again at any time.  ``--report`` prints the tables.  A kind is the signature
of a violation.  Seeds below 1000 were used in development.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from lab.table import Key, ResultTable, Row, run_study
from pytest_garl import cpu_dispatch
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.result import FlightResult
from pytest_garl.gate.gate_statistics import holm_adjusted
from pytest_garl.npcs.domain_policy import policy_in
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY, policy_spec
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.columns import INTERFERING, Columns
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import find_method
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.kinds import hill_number, kinds_in_violations
from pytest_garl.verdicts.statistics import mann_whitney
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, cause_of

MAPS = ("court", "lawn")
SYSTEMS = ("opencv", "mm")
METHODS = ("garl", "random")
BUDGET, POPULATION = 400, 20
FIRST_SEED = 1000
CountsOf = Callable[[Row], list[int]]
"""What counts the violations of each kind in a row."""
TABLE = ResultTable(
    file=Path("docs/kinds.csv"),
    columns=(
        "method",
        "system",
        "seed",
        "map",
        "flights",
        "landed",
        "excused",
        "quiet",
        "quiet_decided",
        "kinds",
    ),
    key=("method", "system", "seed"),
)


def run_search(key: Key) -> dict[str, Any]:
    """Fly one search in this process; return its row.

    ``quiet`` counts the flights without an NPC that knows of the UAV, ``quiet_decided`` those of
    them that decided distance and time, and ``kinds`` holds the numbers of each kind's flights.
    """
    import cv2

    from landing_systems.mm_mls import MultiModuleLandingSystem
    from landing_systems.opencv_mls import OpenCvLandingSystem

    cv2.setNumThreads(1)
    method_name, system, seed = key
    made: Any = {"opencv": OpenCvLandingSystem, "mm": MultiModuleLandingSystem}[system]
    map = load_map(MAPS[int(seed) % len(MAPS)])
    domain = domain_named("field")
    columns = Columns(genome_of(domain, map))
    npcs = policy_spec(policy_in(domain, DEFAULT_POLICY))
    plan = SearchPlan(map=map, genome=columns.genome, seed=int(seed), population=POPULATION)
    method = find_method(method_name)(plan)
    kinds: defaultdict[str, list[int]] = defaultdict(list)
    counts = dict.fromkeys(("flights", "landed", "excused", "quiet", "quiet_decided"), 0)
    for _ in range(BUDGET // POPULATION):
        scenarios = method.ask()
        flown = []
        for scenario in scenarios:
            result = judged(fly(scenario, made, npcs, map=map), DEFAULT_LIMITS)
            flown.append(FlownScenario(scenario=scenario, result=result))
            counts["flights"] += 1
            counts["landed"] += result.verdict.completed
            counts["excused"] += result.verdict.no_landing in ("excused", "blocked")
            if _is_quiet(scenario, columns):
                counts["quiet"] += 1
                counts["quiet_decided"] += _is_decided(result)
            if result.signature:
                kinds[result.signature].append(counts["flights"])
        if method.learns:
            method.tell(flown)
    row = dict(zip(TABLE.key, key, strict=True)) | counts
    return {**row, "map": map.name, "kinds": json.dumps(dict(sorted(kinds.items())))}


def _is_quiet(scenario: Scenario, columns: Columns) -> bool:
    return columns.stratum(encode(scenario, columns.genome)) != INTERFERING


def _is_decided(result: FlightResult) -> bool:
    margins = [result.verdict.margin(name) for name in ("distance", "time")]
    return all(margin is not None and margin.decided for margin in margins)


def counts_of(row: Row) -> list[int]:
    """Return how many violations a search found of each kind."""
    return [len(flights) for flights in json.loads(row["kinds"]).values()]


def causes_of(row: Row) -> list[int]:
    """Return how many violations a search found of each type and cause, a coarser kind."""
    counts: Counter[str] = Counter()
    for kind, flights in json.loads(row["kinds"]).items():
        counts[cause_of(kind)] += len(flights)
    return list(counts.values())


def report(rows: list[Row]) -> str:
    """Return a Markdown table of means over seeds, and what Mann-Whitney's test says."""
    lines = [
        "| system | method | searches | landed, % | violations, % | kinds | effective kinds "
        "| times random's | p (Holm) | kinds at equal violations "
        "| decided without interference, % |",
        "| --- | --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: |",
    ]
    systems = [name for name in SYSTEMS if any(row["system"] == name for row in rows)]
    of = {
        (system, method): [
            row for row in rows if (row["system"], row["method"]) == (system, method)
        ]
        for system, method in itertools.product(systems, METHODS)
    }
    adjusted = _p_values(of, systems, counts_of)
    for (system, method), own in of.items():
        if not own:
            continue
        least = min(sum(counts_of(row)) for name in METHODS for row in of[system, name])
        effective = [hill_number(counts_of(row), 1) for row in own]
        is_garl = method == METHODS[0]
        cells = (
            f"{_percent(own, 'landed', 'flights'):.1f}",
            f"{np.mean([100 * sum(counts_of(row)) / int(row['flights']) for row in own]):.1f}",
            f"{np.mean([len(counts_of(row)) for row in own]):.1f}",
            f"{np.mean(effective):.1f} ({min(effective):.1f} to {max(effective):.1f})",
            f"{_times(own, of[system, METHODS[1]], counts_of):.2f}" if is_garl else "–",
            f"{adjusted[system]:.2g}" if is_garl else "–",
            f"{np.mean([kinds_in_violations(counts_of(row), least) for row in own]):.1f} "
            f"of {least}",
            f"{_percent(own, 'quiet_decided', 'quiet'):.1f}",
        )
        lines.append(f"| {system} | {method} | {len(own)} | {' | '.join(cells)} |")
    coarser = _p_values(of, systems, causes_of)
    for system in systems:
        own, others = (of[system, method] for method in METHODS)
        lines += ["", _only_random(system, of)]
        lines += [
            f"{system} by type and cause alone: {_effective(own, causes_of):.1f} effective ones of "
            f"garl, {_effective(others, causes_of):.1f} of random, "
            f"{_times(own, others, causes_of):.2f} times, p = {coarser[system]:.2g} (Holm)."
        ]
    return "\n".join(lines)


def _only_random(system: str, of: Mapping[tuple[str, str], Sequence[Row]]) -> str:
    """Return how many kinds all searches of each method found, and how many only random's."""
    garl, chance = (
        {kind for row in of[system, method] for kind in json.loads(row["kinds"])}
        for method in METHODS
    )
    return (
        f"{system}: {len(garl)} kinds in all searches of garl, {len(chance)} in those of random, "
        f"{len(chance - garl)} in those of random alone."
    )


def _effective(rows: Sequence[Row], counts: CountsOf) -> float:
    """Return the mean effective number of kinds of searches."""
    return float(np.mean([hill_number(counts(row), 1) for row in rows])) if rows else math.nan


def _times(rows: Sequence[Row], others: Sequence[Row], counts: CountsOf) -> float:
    """Return the mean effective number of kinds as a multiple of that of other searches."""
    return _effective(rows, counts) / _effective(others, counts)


def _p_values(
    of: Mapping[tuple[str, str], Sequence[Row]], systems: Sequence[str], counts: CountsOf
) -> dict[str, float]:
    """Return, for each system, the p value that effective kinds are alike, adjusted."""
    found = []
    for system in systems:
        values = [[hill_number(counts(row), 1) for row in of[system, method]] for method in METHODS]
        found.append(mann_whitney(values[0], values[1])[1] if min(map(len, values)) > 1 else 1.0)
    return dict(zip(systems, holm_adjusted(found), strict=True))


def _percent(rows: Sequence[Row], part: str, whole: str) -> float:
    return 100 * sum(int(row[part]) for row in rows) / max(1, sum(int(row[whole]) for row in rows))


def main() -> None:
    """Fly the missing searches, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="how many; default 10")
    parser.add_argument("--systems", nargs="+", default=list(SYSTEMS))
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    run_study(parser, TABLE, report, fly_searches)


def fly_searches(arguments: argparse.Namespace) -> None:
    """Fly the searches that the table lacks; a search is flown in one process."""
    seeds = range(FIRST_SEED, FIRST_SEED + arguments.seeds)
    keys = (
        (method, system, str(seed))
        for seed, system, method in itertools.product(seeds, arguments.systems, arguments.methods)
    )
    search_missing(keys, arguments.workers)


def search_missing(keys: Iterable[Key], workers: int) -> None:
    """Append the row of each search that the table lacks, as soon as it has ended."""
    known = TABLE.keys()
    cpu_dispatch.pin()
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        runs = [pool.submit(run_search, key) for key in keys if key not in known]
        for run in as_completed(runs):
            TABLE.append([run.result()])


if __name__ == "__main__":
    main()
