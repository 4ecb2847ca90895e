"""Which differences the judges can see: from old seeds, and from the stand-in.

Nothing here is of a seed that judges anything.  Judge 1 from docs/faults.csv (seeds 1 to 5 of an
older search), judge 2 from docs/kinds.csv (older, seeds 1000 to 1009) and docs/judge-stand-in.csv
(the same searches for causes, of the stand-in, seeds 204 to 211), judge 3 from the collisions of
one chasing NPC in docs/grades.csv.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import norm, t

from lab.faults.catalogue import FAULTS
from lab.judges import causes, faults, preventable
from lab.judges.flights import MAPS, SYSTEMS
from lab.judges.intervals import Estimate, over_clusters, over_pairs
from lab.table import Row, read_csv

POWER = 0.8
RUNS = 300
"""Simulated studies for one power."""


def seen_difference(deviation: float, pairs: int) -> float:
    """Return the difference of means that a paired t-test sees with a power of 80 %."""
    return float((t.ppf(0.975, pairs - 1) + norm.ppf(POWER)) * deviation / pairs**0.5)


def seen_ratio(estimate: Estimate) -> float:
    """Return the ratio whose interval lies below 1 with a power of 80 %, for such an interval."""
    deviation = np.log(estimate.high / estimate.low) / (2 * norm.ppf(0.975))
    return float(np.exp(-(norm.ppf(0.975) + norm.ppf(POWER)) * deviation))


def of_faults(rows: Sequence[Row]) -> str:
    """Return what judge 1 can see, from searches of two methods for the same faults."""
    seeds = sorted({row["seed"] for row in rows})
    names = [each for each in FAULTS if any(row["fault"] == each.name for row in rows)]
    tables = np.full((2, len(names), len(seeds)), np.nan)
    for row in rows:
        place = next((i for i, each in enumerate(names) if each.name == row["fault"]), None)
        if place is not None:
            side = ("garl", "random").index(row["method"])
            found = int(row["found_at"] or faults.FLIGHTS)
            tables[side, place, seeds.index(row["seed"])] = found
    ratio = over_clusters(tables[0], tables[1], [each.family for each in names])
    return (
        f"Judge 1: of an older search, {len(seeds)} seeds and {len(names)} faults, the flights as "
        f"a multiple of random's are {ratio.text()}. With an interval as wide, a true ratio of "
        f"{seen_ratio(ratio):.2f} or less is seen to be below 1 in {100 * POWER:.0f} % of studies."
    )


def of_causes(
    pairs: int, counted: str, title: str, differences: Sequence[float], mean: float
) -> str:
    """Return what judge 2 can see, from paired differences of what a search found."""
    deviation = float(np.std(differences, ddof=1))
    seen = seen_difference(deviation, pairs)
    return (
        f"Judge 2, {title}: paired differences of {counted} have a standard deviation of "
        f"{deviation:.1f} ({len(differences)} pairs); {pairs} pairs see a difference of "
        f"{seen:.1f}, {100 * seen / mean:.0f} % of the mean of {mean:.1f}, in {100 * POWER:.0f} % "
        "of studies."
    )


def of_kinds(rows: Sequence[Row]) -> str:
    """Return it from real flights of an older search against random."""
    counts = {
        (row["method"], row["system"], row["seed"]): _later_kinds(row["kinds"]) for row in rows
    }
    keys = [key[1:] for key in counts if key[0] == "random"]
    differences = [counts["garl", *key] - counts["random", *key] for key in keys]
    mean = float(np.mean([counts["garl", *key] for key in keys]))
    title = "old seeds, garl less random"
    return of_causes(len(causes.SEEDS) * len(SYSTEMS), "kinds", title, differences, mean)


def _later_kinds(kinds: str, control: int = 20) -> float:
    return float(sum(max(flights) > control for flights in json.loads(kinds).values()))


def of_stand_in(rows: Sequence[Row], rival: str) -> str:
    """Return it from the same searches for causes of the stand-in."""
    counts = {(row["arm"], row["system"], row["seed"]): float(row["count"]) for row in rows}
    keys = [key[1:] for key in counts if key[0] == rival]
    differences = [counts[causes.OURS, *key] - counts[rival, *key] for key in keys]
    mean = float(np.mean([counts[causes.OURS, *key] for key in keys]))
    title = f"stand-in, garl less {rival}"
    return of_causes(len(causes.SEEDS) * len(SYSTEMS), "causes", title, differences, mean)


def of_preventable(rows: Sequence[Row]) -> str:
    """Return what judge 3 can see, from the rate of collisions of one chasing NPC."""
    own = [row for row in rows if (row["mover"], row["npcs"]) == ("chasing intercepting", "one")]
    flights, collided = (sum(int(row[name]) for row in own) for name in ("flights", "collided"))
    count = preventable.FLIGHTS * len(SYSTEMS) * len(MAPS)
    lines = []
    for share in (0.25, 0.5):
        rate = share * collided / flights
        powers = [
            f"{times:g} times with {100 * power_of_ratio(rate, times, count):.0f} %"
            for times in (1.5, 2.0, 2.5)
        ]
        lines.append(
            f"if {100 * share:.0f} % of the collisions of a gene's begin count "
            f"({100 * rate:.1f} per 100 flights), it sees {', '.join(powers)}"
        )
    return (
        f"Judge 3: one chasing NPC hit in {collided} of {flights} older flights. With {count} "
        f"flights an arm, {'; '.join(lines)} of studies."
    )


def power_of_ratio(rate: float, times: float, count: int) -> float:
    """Return in how many studies the interval of a ratio lies above 1."""
    rng = np.random.default_rng(1)
    seen = 0
    for _ in range(RUNS):
        own, rival = (rng.random(count) < each for each in (min(1.0, times * rate), rate))
        seen += over_pairs(own, rival, difference=False, resamples=1000).low > 1
    return seen / RUNS


def report() -> str:
    """Return what the judges can see."""
    docs = Path("docs")
    stand_in = read_csv(docs / "judge-stand-in.csv")
    rivals = [arm for arm in dict.fromkeys(row["arm"] for row in stand_in) if arm != causes.OURS]
    return "\n".join(
        (
            of_faults(read_csv(docs / "faults.csv")),
            of_kinds(read_csv(docs / "kinds.csv")),
            *(of_stand_in(stand_in, rival) for rival in rivals),
            of_preventable(read_csv(docs / "grades.csv")),
        )
    )
