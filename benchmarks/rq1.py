"""The first question of the paper: how often, and how, the three landing systems fail.

``python -m benchmarks.rq1`` flies what ``docs/rq1.csv`` lacks, one system after the other on both
maps with the paper's method and policy, and can be stopped and started again at any time;
``--report`` prints the tables of what is there, beside the paper's.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.methods import run
from benchmarks.rows import append, read, share
from pytest_garl.search.ledger import Ledger
from pytest_garl.verdicts.metrics import top_k
from pytest_garl.verdicts.serialise import from_dict

FILE = Path("docs/rq1.csv")
TESTS = {
    "OpenCV-MLS": "landing_systems/test_opencv_mls.py",
    "TPHYolo-MLS": "landing_systems/test_tphyolo_mls.py",
    "MM-MLS": "landing_systems/test_mm_mls.py",
}
MAPS = ("court", "lawn")
TYPES = ("I", "II", "III", "IV", "V")
COUNTS = ("flights", "violations", *TYPES, "late", "off", "hard", "aborted")
FIELDS = ("system", "map", "method", "seed", *COUNTS, "signatures", "top10", "result_hash")
PAPERS = {
    ("OpenCV-MLS", "court"): (71.50, (63, 31, 1, 4, 1)),
    ("TPHYolo-MLS", "court"): (30.96, (10, 21, 5, 53, 11)),
    ("MM-MLS", "court"): (20.60, (12, 35, 2, 45, 6)),
    ("OpenCV-MLS", "lawn"): (42.75, (7, 3, 1, 79, 10)),
    ("TPHYolo-MLS", "lawn"): (38.25, (1, 2, 1, 88, 8)),
    ("MM-MLS", "lawn"): (17.11, (28, 48, 1, 18, 5)),
}
"""The paper's table of RQ1 and figure 10 of its supplement: violations and their types, in %."""


def rows_of(path: Path, system: str, method: str, seed: int) -> list[dict[str, Any]]:
    """Return a row of figures per map."""
    ledger = Ledger(path)
    rows = []
    for map in MAPS:
        flown = [each[-1] for each in ledger.results() if each[1] == map]
        verdicts = [from_dict(result["verdict"]) for result in flown]
        kinds = Counter(
            (verdict.violation_type or "").rstrip("?") for verdict in verdicts if verdict.primary
        )
        rows.append(
            {
                "system": system,
                "map": map,
                "method": method,
                "seed": seed,
                "flights": len(verdicts),
                "violations": sum(verdict.paper_violation for verdict in verdicts),
                **{kind: kinds[kind] for kind in (*TYPES, "late", "off", "hard")},
                "aborted": sum(verdict.outcome == "aborted" for verdict in verdicts),
                "signatures": len({v.signature for v in verdicts if v.paper_violation}),
                "top10": top_k(verdicts) or "",
                "result_hash": ledger.result_hash()[:16],
            }
        )
    return rows


def report(rows: list[dict[str, str]]) -> str:
    """Return a Markdown table: our shares with intervals, the paper's beside them."""
    lines = [
        "| map | system | flights | violations | paper | I / II / III / IV / V | paper, % "
        "| late, off, hard | aborted | signatures |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for map in MAPS:
        for system in TESTS:
            own = [row for row in rows if (row["system"], row["map"]) == (system, map)]
            if not own:
                continue
            sums = {name: sum(int(row[name]) for row in own) for name in COUNTS}
            rate, kinds = PAPERS[system, map]
            lines.append(
                f"| {map} | {system} | {sums['flights']} "
                f"| {share(sums['violations'], sums['flights'])} | {rate} % "
                f"| {' / '.join(str(sums[kind]) for kind in TYPES)} "
                f"| {' / '.join(str(kind) for kind in kinds)} "
                f"| {sums['late']}, {sums['off']}, {sums['hard']} "
                f"| {100 * sums['aborted'] / sums['flights']:.0f} % "
                f"| {', '.join(row['signatures'] for row in own)} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Fly what is missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--budget", type=int, default=400)
    parser.add_argument("--method", default="garl-paper")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--systems", nargs="+", choices=list(TESTS), default=list(TESTS))
    arguments = parser.parse_args()
    known = read(FILE)
    if arguments.report:
        print(report([row for row in known if row["method"] == arguments.method]))
        return
    done = {(row["system"], row["method"], int(row["seed"]), int(row["flights"])) for row in known}
    method, budget = arguments.method, arguments.budget
    for seed in arguments.seeds:
        for system in arguments.systems:
            if (system, method, seed, budget) in done:
                continue
            folder = Path(f".garl/rq1/{system}-{method}-{seed}-{budget}")
            options = [f"--garl-budget={budget}", f"--garl-method={method}", f"--garl-seed={seed}"]
            ledger = run(folder, TESTS[system], options)
            append(FILE, FIELDS, rows_of(ledger, system, method, seed))


if __name__ == "__main__":
    main()
