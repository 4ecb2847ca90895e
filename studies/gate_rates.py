"""How often the gate fails an unchanged landing system, and how often a worse one.

``python -m studies.gate rates`` draws flights with the shares of ``docs/experiments/counts.csv``
and with the distances and times of ``docs/gate.csv``, and draws a part of them again as the changed
system's.  The gate compares both, and the tables go into ``docs/gate.md``.  Nothing is flown.
"""

from __future__ import annotations

import dataclasses
import functools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pytest_garl.baselines.comparison import LEVEL, Comparison, compare
from pytest_garl.baselines.gate_statistics import holm_adjusted
from pytest_garl.baselines.pairs import FlightSummary, Pair
from pytest_garl.regressions.robustness import NEIGHBOURS
from studies.table import read_csv, share

DOCS = Path(__file__).parents[1] / "docs"
COUNTS, LANDINGS = DOCS / "experiments" / "counts.csv", DOCS / "gate.csv"
BUDGETS = (50, 100, 200)
PARTS = (0.1, 0.25, 0.5, 1.0)
LANDED = FlightSummary(outcome="landed", signature="", sha256="base")
EXCUSED = FlightSummary(outcome="gave_up", signature="", no_landing="excused", sha256="base")
NEEDLESS = FlightSummary(
    outcome="gave_up",
    signature="II:gave-up-in-sight:descent",
    no_landing="needless",
    sha256="base",
)
KNOWN = FlightSummary(outcome="collision", signature="IV:person:descent:seen", sha256="head")
NEW = FlightSummary(outcome="collision", signature="III:tree:descent", sha256="head")
RARE = (
    FlightSummary(outcome="slid", signature="slid:motors-on", sha256="base"),
    FlightSummary(outcome="landed", signature="I:line:unseen", sha256="base"),
    FlightSummary(outcome="landed", signature="late:landed:descent", sha256="base"),
    FlightSummary(outcome="crashed", signature="V:ValueError@planner.plan", sha256="base"),
)
EXPECTED = 2.5
"""Expected number of flights of a baseline with each rare type: of 0.6 to 5, about the number at
which four rare types cause most false alarms."""


Random = np.random.Generator
NeighbourOf = Callable[[FlightSummary], FlightSummary]
"""Returns the summary of a neighbour, given the summary of its flight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedSystem:
    """A landing system as a distribution over summaries of flights.

    Each landing gets distance and time of one of the ``landings``.
    """

    name: str
    landings: tuple[FlightSummary, ...]
    summaries: tuple[FlightSummary, ...]
    shares: tuple[float, ...]

    def draw(self, count: int, rng: Random) -> list[FlightSummary]:
        """Return the summaries of ``count`` flights."""
        drawn = [
            self.summaries[index] for index in rng.choice(len(self.shares), count, p=self.shares)
        ]
        places = rng.integers(len(self.landings), size=count)
        return [
            self.landings[place] if summary is LANDED else summary
            for summary, place in zip(drawn, places, strict=True)
        ]

    def with_rare(self, budget: int) -> SimulatedSystem:
        """Return the same with types so rare that a baseline often misses them."""
        each = EXPECTED / budget
        left = (value * (1 - each * len(RARE)) for value in self.shares)
        return dataclasses.replace(
            self,
            name=f"{self.name}, and four rare types",
            summaries=(*self.summaries, *RARE),
            shares=(*left, *[each] * len(RARE)),
        )


def measured(system: str, method: str) -> SimulatedSystem:
    """Return a landing system in the scenarios of a method: all its rows of the counts together.

    The counts do not say why a landing was given up: in the dark it counts as excused, else as
    needless.
    """
    counts = Counter[FlightSummary]()
    for row in read_csv(COUNTS):
        if (row["system"], row["method"]) == (system, method):
            counts[LANDED] += int(row["landed"])
            counts[EXCUSED] += int(row["dark_aborted"])
            counts[NEEDLESS] += int(row["aborted"]) - int(row["dark_aborted"])
            for kind in filter(None, row["kinds"].split("|")):
                signature, _, count = kind.rpartition("=")
                summary = FlightSummary(outcome="collision", signature=signature, sha256="base")
                counts[summary] += int(count)
    total = counts.total()
    return SimulatedSystem(
        name=f"{system}, {method}",
        landings=flown_landings(),
        summaries=tuple(counts),
        shares=tuple(count / total for count in counts.values()),
    )


@functools.cache
def flown_landings() -> tuple[FlightSummary, ...]:
    """Return the landings of OpenCV-MLS that were flown; the counts hold no distances."""
    return tuple(
        dataclasses.replace(
            LANDED, distance_m=float(row["distance_m"]), time_s=float(row["time_s"])
        )
        for row in read_csv(LANDINGS)
    )


def landing_always() -> SimulatedSystem:
    """Return a system that lands in each flight, so that distance and time alone can differ."""
    return SimulatedSystem(
        name="OpenCV-MLS, landings alone",
        landings=flown_landings(),
        summaries=(LANDED,),
        shares=(1.0,),
    )


def systems() -> Iterator[SimulatedSystem]:
    """Yield the systems of the table, from few violations to many."""
    yield measured("MM-MLS", "surrogate-random")
    yield measured("MM-MLS", "random")
    yield measured("OpenCV-MLS", "garl-paper")
    yield measured("MM-MLS", "random with dqn")
    yield landing_always()


def by_chance(system: SimulatedSystem, rng: Random) -> NeighbourOf:
    """Return neighbours that are independent flights."""
    return lambda _: system.draw(1, rng)[0]


def alike(probability: float, rng: Random) -> NeighbourOf:
    """Return neighbours that end like their flight with a probability, and else land."""
    return lambda summary: summary if rng.random() < probability else LANDED


def partly_redrawn(
    base: Sequence[FlightSummary], part: float, system: SimulatedSystem, rng: Random
) -> list[FlightSummary]:
    """Return the flights with a part of them drawn again; only these have other hashes."""
    head = list(base)
    chosen = rng.choice(len(head), round(part * len(head)), replace=False)
    for index, summary in zip(chosen, system.draw(len(chosen), rng), strict=True):
        head[index] = dataclasses.replace(summary, sha256="head")
    return head


def worsened(
    head: Sequence[FlightSummary], part: float, into: FlightSummary, rng: Random
) -> list[FlightSummary]:
    """Return the flights with violations in place of landings, in a part of all flights."""
    landed = [index for index, summary in enumerate(head) if summary.outcome == "landed"]
    count = min(len(landed), int(rng.binomial(len(head), part)))
    chosen = set(rng.choice(landed, count, replace=False).tolist()) if landed else set[int]()
    return [into if index in chosen else summary for index, summary in enumerate(head)]


def gated(
    base: Sequence[FlightSummary], head: Sequence[FlightSummary], beside: NeighbourOf
) -> Comparison:
    """Return the result of the gate, with neighbours of new types."""
    pairs = [
        Pair(name=str(index), base=before, head=after)
        for index, (before, after) in enumerate(zip(base, head, strict=True))
    ]
    found = compare(pairs)
    if not found.pairs_to_confirm:
        return found
    flown = {
        pair.name: [beside(pair.head) for _ in range(NEIGHBOURS)] for pair in found.pairs_to_confirm
    }
    return compare(pairs, neighbours=flown)


def uncorrected(found: Comparison) -> bool:
    """Return whether a gate would fail that accepts each new type, whatever its p-value."""
    tests = [
        *(change.p for change in found.rates if change.can_fail(LEVEL)),
        *(change.p for change in found.sizes if change.can_fail(LEVEL)),
    ]
    return min(holm_adjusted(tests), default=1.0) <= LEVEL or any(
        each.is_supported for each in found.new_types
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarms:
    """Failures in all draws: of the gate, of one without correction, of one in a hostile world."""

    gate: int
    uncorrected: int
    hostile: int


def false_alarms(
    system: SimulatedSystem, budget: int, part: float, draws: int, rng: Random
) -> Alarms:
    """Count failures of an unchanged landing system.

    Neighbours are drawn again too; in the hostile world all neighbours of a violation fail as it
    does.
    """
    counts = Counter[str]()
    chance, always = by_chance(system, rng), alike(1.0, rng)
    for _ in range(draws):
        base = system.draw(budget, rng)
        head = partly_redrawn(base, part, system, rng)
        found = gated(base, head, chance)
        counts["gate"] += not found.passed
        counts["uncorrected"] += uncorrected(found)
        hostile = gated(base, head, always) if found.new_types else found
        counts["hostile"] += not hostile.passed
    return Alarms(gate=counts["gate"], uncorrected=counts["uncorrected"], hostile=counts["hostile"])


def detected(
    system: SimulatedSystem,
    budget: int,
    part: float,
    worse: float,
    into: FlightSummary,
    robust: float,
    draws: int,
    rng: Random,
) -> int:
    """Count failures of a system ``worse`` of whose flights became violations, a part drawn again.

    Each neighbour of a violation of the new type fails alike with the probability ``robust``.
    """
    beside = alike(robust, rng)
    failed = 0
    for _ in range(draws):
        base = system.draw(budget, rng)
        head = worsened(partly_redrawn(base, part, system, rng), worse, into, rng)
        failed += not gated(base, head, beside).passed
    return failed


def alarm_table(draws: int, rng: Random) -> Iterator[str]:
    """Yield the table of false alarms, line by line."""
    named = list(systems())
    names = [each.name for each in named]
    yield f"| flights | drawn anew | {' | '.join(names)} | {names[1]}, and four rare types |"
    yield "| --- " * (len(named) + 3) + "|"
    for budget in BUDGETS:
        for part in PARTS:
            cells = []
            for system in (*named, named[1].with_rare(budget)):
                found = false_alarms(system, budget, part, draws, rng)
                others = ", ".join(
                    f"{100 * count / draws:.1f}" for count in (found.uncorrected, found.hostile)
                )
                cells.append(f"{share(found.gate, draws)}; {others}")
            yield f"| {budget} | {100 * part:.0f} % | {' | '.join(cells)} |"


def power_table(draws: int, rng: Random) -> Iterator[str]:
    """Yield the table of what is detected, line by line."""
    system = measured("MM-MLS", "random")
    columns = [
        *((f"{100 * worse:.0f} points more", worse, KNOWN, 0.0) for worse in (0.05, 0.1, 0.2)),
        *(
            (f"new type in {100 * worse:.0f} %, {words}", worse, NEW, robust)
            for worse in (0.02, 0.05)
            for words, robust in (("half the neighbours alike", 0.5), ("none", 0.0))
        ),
    ]
    yield f"| flights | drawn anew | {' | '.join(name for name, *_ in columns)} |"
    yield "| --- " * (len(columns) + 2) + "|"
    for budget in BUDGETS:
        for part in (0.0, 0.1, 1.0):
            cells = [
                share(detected(system, budget, part, worse, into, robust, draws, rng), draws)
                for _, worse, into, robust in columns
            ]
            yield f"| {budget} | {100 * part:.0f} % | {' | '.join(cells)} |"
