"""The search methods side by side, one finished search after the other appended to a CSV.

``python -m studies.methods`` flies what the CSV lacks, and can be stopped and started again at
any time; ``--report`` prints the table of what is there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.execution.job import load_scenario
from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.search.objectives import diversity
from pytest_garl.verdicts.paper_metrics import top_k
from studies.rows import append, read, share

FILE = Path("docs/methods.csv")
METHODS = ("random", "garl-paper", "garl")
MOVERS = ("ga", "offline-rl", "online-rl", "surrogate-random")
"""Methods that are what they are by who moves the objects; with the others they walk at random."""
FIELDS = (
    "method",
    "seed",
    "map",
    "budget",
    "violations",
    "late",
    "aborted",
    "top10",
    "signatures",
    "parameter_distance",
    "result_hash",
)


def search(method: str, seed: int, budget: int) -> Path:
    """Fly both maps, or go on with it; return the ledger."""
    folder = Path(f".garl/methods/{method}-{seed}-{budget}")
    options = [f"--garl-budget={budget}", f"--garl-method={method}", f"--garl-seed={seed}"]
    if method not in MOVERS:
        options.append("--garl-npcs=waypoint")
    return run(folder, "landing_systems/test_opencv_mls.py", options)


def run(folder: Path, tests: str, options: Sequence[str]) -> Path:
    """Run a search with its files in ``folder``, or go on with it; return the ledger."""
    ledger = folder / "ledger.sqlite"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--tb=no", "-r", ""]
    command += [
        *options,
        "--garl-shrink=0",
        "-o",
        f"garl_dir={folder}",
        tests,
        *["--garl-resume"] * ledger.exists(),
    ]
    done = subprocess.run(command, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(done.returncode)
    return ledger


def rows_of(path: Path, method: str, seed: int, budget: int) -> list[dict[str, Any]]:
    """Return a row of figures per map."""
    ledger = Ledger(path)
    rows = []
    for name in ("court", "lawn"):
        genome = genome_for(load_map(name))
        flown = [each for each in ledger.queries.results() if each[1] == name]
        verdicts = [each[-1].verdict for each in flown]
        texts = [
            ledger.queries.scenarios(generation, slot, name)[system]
            for system, _, generation, slot, _ in flown
        ]
        # As in the paper's RQ: how different the violating scenarios are from each other, by the
        # genes that all methods have.
        genes = [
            genome.normalise(np.array([load_scenario(text)[key] for key in genome.keys]))
            for text, verdict in zip(texts, verdicts, strict=True)
            if verdict.paper_violation
        ]
        rows.append(
            {
                "method": method,
                "seed": seed,
                "map": name,
                "budget": budget,
                "violations": sum(verdict.paper_violation for verdict in verdicts),
                "late": sum(verdict.violation_type == "late" for verdict in verdicts),
                "aborted": sum(verdict.outcome == "aborted" for verdict in verdicts),
                "top10": top_k(verdicts) or "",
                "signatures": len({v.signature for v in verdicts if v.paper_violation}),
                "parameter_distance": f"{np.mean(diversity(np.array(genes))):.3f}" if genes else "",
                "result_hash": ledger.queries.result_hash()[:16],
            }
        )
    return rows


def report(rows: list[dict[str, str]]) -> str:
    """Return a Markdown table: each cell the mean over seeds, violations with their interval."""
    lines = [
        "| map | method | seeds | violations | aborted | Top-10 | signatures | distance |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    # Rows of an earlier form of a method are kept as method@commit.
    methods = dict.fromkeys((*METHODS, *(row["method"] for row in rows)))
    for map in ("court", "lawn"):
        for method in methods:
            own = [row for row in rows if (row["map"], row["method"]) == (map, method)]
            if not own:
                continue
            count = sum(int(row["violations"]) for row in own)
            total = sum(int(row["budget"]) for row in own)
            aborted = sum(int(row["aborted"]) for row in own)
            tops = [row["top10"] or "–" for row in own]
            kinds = [row["signatures"] for row in own]
            spread = [float(row["parameter_distance"]) for row in own if row["parameter_distance"]]
            lines.append(
                f"| {map} | {method} | {len(own)} | {share(count, total)} "
                f"| {100 * aborted / total:.0f} % "
                f"| {', '.join(tops)} | {', '.join(kinds)} | {np.mean(spread):.2f} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Fly what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--budget", type=int, default=400)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    arguments = parser.parse_args()
    known = read(FILE)
    if arguments.report:
        print(report(known))
        return
    done = {(row["method"], int(row["seed"]), int(row["budget"])) for row in known}
    for seed in arguments.seeds:
        for method in arguments.methods:
            if (method, seed, arguments.budget) not in done:
                ledger = search(method, seed, arguments.budget)
                append(FILE, FIELDS, rows_of(ledger, method, seed, arguments.budget))


if __name__ == "__main__":
    main()
