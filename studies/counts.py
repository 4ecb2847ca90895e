"""Counts for the remarks on the experiments, which the rows of the experiments do not contain.

``python -m studies.counts`` reads the ledgers below ``.garl/experiments`` and writes
``docs/experiments/counts.csv``: the flights of each signature, the flights in the dark, and the
outcomes of flights in which at most one object is fast.  The line of a search without a ledger
stays as it is.
"""

from __future__ import annotations

import argparse
import csv
from collections import Counter
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.experiments.measure import HASH_DIGITS
from pytest_garl.experiments.results import SEPARATOR, read_rows
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.weather import conditions_of
from studies.table import read_csv

ROWS_FILE, COUNTS_FILE = Path("docs/experiments/rq.csv"), Path("docs/experiments/counts.csv")
SLOW_SHARE = 0.25
"""An object is slow if its speed lies in this lowest share of its range."""


def count(ledger: Ledger, search: str, map: str) -> dict[str, int | str]:
    """Return a search's counts; ``kinds`` is ``signature=flights``, separated as in rows."""
    counts, signatures = Counter[str](), Counter[str]()
    genome = genome_for(load_map(map))
    speeds = [
        (key, float(low), float(high))
        for key, low, high in zip(genome.keys, genome.lower, genome.upper, strict=True)
        if key.endswith(".velocity")
    ]
    for flight in ledger.queries.flights(search):
        scenario, outcome = parse_scenario(flight.scenario), flight.result.outcome
        if flight.signature:
            signatures[flight.signature] += 1
        counts[outcome] += 1
        if conditions_of(scenario).sun[2] < 0:
            counts["dark"] += 1
            counts[f"dark_{outcome}"] += 1
        if _at_most_one_is_fast(scenario, speeds):
            counts[f"slow_{outcome}"] += 1
    names = {
        "landed": "landed",
        "aborted": "gave_up",
        "dark": "dark",
        "dark_aborted": "dark_gave_up",
        "slow_landed": "slow_landed",
        "slow_collision": "slow_collision",
    }
    return {
        **{column: counts[name] for column, name in names.items()},
        "kinds": SEPARATOR.join(f"{name}={times}" for name, times in sorted(signatures.items())),
    }


def _at_most_one_is_fast(scenario: Scenario, speeds: Iterable[tuple[str, float, float]]) -> bool:
    fast = [key for key, low, high in speeds if scenario[key] >= low + SLOW_SHARE * (high - low)]
    return len(fast) <= 1


def main() -> None:
    """Count the flights of all ledgers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path(".garl/experiments"))
    folder = parser.parse_args().folder
    rows = {row.result_hash: row for row in read_rows(ROWS_FILE)}
    lines: dict[str, dict[str, int | str]] = {
        line["result_hash"]: dict(line)
        for line in read_csv(COUNTS_FILE)
        if line["result_hash"] in rows
    }
    for path in sorted(folder.glob("*/ledger.sqlite")):
        with closing(Ledger(path)) as ledger:
            for search, text in ledger.searches():
                row = rows.get(ledger.queries.result_hash(search)[:HASH_DIGITS])
                if row is None:
                    continue
                lines[row.result_hash] = {
                    "system": row.system,
                    "map": row.map,
                    "method": row.method,
                    "seed": row.seed,
                    **count(ledger, search, parse_job(text).map),
                    "result_hash": row.result_hash,
                }
    ordered = [lines[key] for key in rows if key in lines]
    with COUNTS_FILE.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(ordered[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(ordered)
    print(f"{len(ordered)} of {len(rows)} searches are counted in {COUNTS_FILE}")


if __name__ == "__main__":
    main()
