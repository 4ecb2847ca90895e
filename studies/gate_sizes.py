"""How often the gate fails a system whose landings became less accurate or slower.

It draws from the landings of ``gate_rates``; ``python -m studies.gate rates`` prints the table.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from pytest_garl.baselines.pairs import FlightSummary
from studies.gate_rates import BUDGETS, Random, by_chance, gated, landing_always, partly_redrawn
from studies.table import share


@dataclass(frozen=True, slots=True, kw_only=True)
class SizeChange:
    """How distance or time of each landing becomes worse."""

    name: str
    what: Literal["distance", "time"]
    factor: float = 1.0
    more: float = 0.0


CHANGES = (
    SizeChange(name="distance × 1.3", what="distance", factor=1.3),
    SizeChange(name="distance × 2", what="distance", factor=2.0),
    SizeChange(name="distance + 0.1 m", what="distance", more=0.1),
    SizeChange(name="distance + 0.38 m", what="distance", more=0.38),
    SizeChange(name="time + 2 s", what="time", more=2.0),
    SizeChange(name="time × 1.3", what="time", factor=1.3),
    SizeChange(name="time × 2", what="time", factor=2.0),
    SizeChange(name="time + 20 s", what="time", more=20.0),
)


def resized(flight: FlightSummary, change: SizeChange) -> FlightSummary:
    """Return the landing with another distance or time."""
    distance_m, time_s = flight.distance_m, flight.time_s
    assert distance_m is not None
    assert time_s is not None
    if change.what == "distance":
        distance_m = distance_m * change.factor + change.more
    else:
        time_s = time_s * change.factor + change.more
    return dataclasses.replace(flight, sha256="head", distance_m=distance_m, time_s=time_s)


def size_detected(change: SizeChange, budget: int, part: float, draws: int, rng: Random) -> int:
    """Count failures if each landing becomes worse, a part of them drawn again before."""
    system = landing_always()
    failed = 0
    for _ in range(draws):
        base = system.draw(budget, rng)
        head = [resized(each, change) for each in partly_redrawn(base, part, system, rng)]
        failed += not gated(base, head, by_chance(system, rng)).passed
    return failed


def size_table(draws: int, rng: Random) -> Iterator[str]:
    """Yield the table of worse distances and times that are detected, line by line."""
    yield f"| pairs that landed | drawn anew | {' | '.join(each.name for each in CHANGES)} |"
    yield "| --- " * (len(CHANGES) + 2) + "|"
    for budget in BUDGETS:
        for part in (0.0, 0.1, 1.0):
            cells = [
                share(size_detected(change, budget, part, draws, rng), draws) for change in CHANGES
            ]
            yield f"| {budget} | {100 * part:.0f} % | {' | '.join(cells)} |"
