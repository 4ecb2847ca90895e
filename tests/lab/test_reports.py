"""Reports of studies from rows."""

from __future__ import annotations

import json

from lab import ablations
from lab.table import Row


def test_ablations_are_compared_seed_by_seed() -> None:
    def row(variant: str, seed: int, kinds: int) -> dict[str, str]:
        counts = {f"IV:{number}": 10 for number in range(kinds)}
        facts = {"map": "court", "budget": "400", "landing": "sturdy"}
        early = {"early": "2", "middle": str(kinds - 1), "first": "9"}
        return {
            "variant": variant,
            "seed": str(seed),
            **facts,
            **early,
            "kinds": json.dumps(counts),
        }

    seeds = (1, 2, 3)
    rows: list[Row] = [row("garl", seed, 4 + seed) for seed in seeds]
    rows += [row("random", seed, 2 + seed) for seed in seeds]
    last = ablations.report(rows).splitlines()[-1]
    cells = [cell.strip() for cell in last.strip("|").split("|")]
    assert cells[:6] == ["random", "3", "4.0", "-2.0 ± 0.0", "3.0", "-2.0 ± 0.0"]
