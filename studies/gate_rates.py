"""How often the gate fails a stack that did not change, and how often one that got worse.

``python -m studies.gate rates`` draws flights in the shares of ``docs/experiments/counts.csv``,
draws some of them anew, lets the gate compare both, and writes its tables into ``docs/gate.md``.
Nothing is flown.
"""

from __future__ import annotations

import dataclasses
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
COUNTS, PAGE = DOCS / "experiments" / "counts.csv", DOCS / "gate.md"
BEGIN, END = "<!-- Written by `python -m studies.gate rates`: -->\n", "<!-- To here. -->\n"
BUDGETS = (50, 100, 400)
SHAKEN = (0.1, 0.25, 0.5, 1.0)
LANDED = FlightSummary(outcome="landed", signature="", sha256="base")
ABORTED = FlightSummary(outcome="aborted", signature="", sha256="base")
KNOWN = FlightSummary(outcome="collision", signature="IV:person:descent:seen", sha256="head")
NEW = FlightSummary(outcome="collision", signature="III:tree:descent", sha256="head")
RARE = (
    FlightSummary(outcome="not_landed", signature="II:lost:descent", sha256="base"),
    FlightSummary(outcome="landed", signature="I:phantom:descent", sha256="base"),
    FlightSummary(outcome="not_landed", signature="late:not-landed:search", sha256="base"),
    FlightSummary(outcome="crashed", signature="V:ValueError@planner.plan", sha256="base"),
)
EXPECTED = 2.5
"""Flights of a baseline in which each rare type is expected: of 0.6 to 5, about the number at which
four of them fool the gate most often."""
Random = np.random.Generator
Beside = Callable[[FlightSummary], FlightSummary]
"""What a neighbour comes to of a flight that came to an answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stack:
    """A landing stack as a distribution: each flight comes to one of the answers."""

    name: str
    answers: tuple[FlightSummary, ...]
    shares: tuple[float, ...]

    def draw(self, count: int, rng: Random) -> list[FlightSummary]:
        """Return what ``count`` flights come to."""
        return [self.answers[index] for index in rng.choice(len(self.shares), count, p=self.shares)]

    def with_rare(self, budget: int) -> Stack:
        """Return the same with types so rare that a baseline often misses them."""
        each = EXPECTED / budget
        left = (value * (1 - each * len(RARE)) for value in self.shares)
        return Stack(
            name=f"{self.name}, and four rare types",
            answers=(*self.answers, *RARE),
            shares=(*left, *[each] * len(RARE)),
        )


def measured(system: str, method: str) -> Stack:
    """Return a landing system in the scenarios of a method: all its rows of the counts together."""
    counts = Counter[FlightSummary]()
    for row in read_csv(COUNTS):
        if (row["system"], row["method"]) == (system, method):
            counts[LANDED] += int(row["landed"])
            counts[ABORTED] += int(row["aborted"])
            for kind in filter(None, row["kinds"].split("|")):
                signature, _, count = kind.rpartition("=")
                answer = FlightSummary(outcome="collision", signature=signature, sha256="base")
                counts[answer] += int(count)
    total = counts.total()
    return Stack(
        name=f"{system}, {method}",
        answers=tuple(counts),
        shares=tuple(count / total for count in counts.values()),
    )


def stacks() -> Iterator[Stack]:
    """Yield those that the table is about, from few violations to many."""
    yield measured("MM-MLS", "surrogate-random")
    yield measured("MM-MLS", "random")
    yield measured("OpenCV-MLS", "garl-paper")
    yield measured("MM-MLS", "random with dqn")


def by_chance(stack: Stack, rng: Random) -> Beside:
    """Return neighbours that are flights like any other."""
    return lambda _: stack.draw(1, rng)[0]


def alike(probability: float, rng: Random) -> Beside:
    """Return neighbours that end like the flight beside them with a probability, and else land."""
    return lambda answer: answer if rng.random() < probability else LANDED


def shaken(
    base: Sequence[FlightSummary], part: float, stack: Stack, rng: Random
) -> list[FlightSummary]:
    """Return the flights with a part of them drawn anew: these have other bytes, the rest not."""
    head = list(base)
    chosen = rng.choice(len(head), round(part * len(head)), replace=False)
    for index, answer in zip(chosen, stack.draw(len(chosen), rng), strict=True):
        head[index] = dataclasses.replace(answer, sha256="head")
    return head


def worsened(
    head: Sequence[FlightSummary], part: float, into: FlightSummary, rng: Random
) -> list[FlightSummary]:
    """Return the flights with a part of all, taken from those that land, ending in a violation."""
    landed = [index for index, answer in enumerate(head) if answer.outcome == "landed"]
    count = min(len(landed), int(rng.binomial(len(head), part)))
    chosen = set(rng.choice(landed, count, replace=False).tolist()) if landed else set[int]()
    return [into if index in chosen else answer for index, answer in enumerate(head)]


def gated(
    base: Sequence[FlightSummary], head: Sequence[FlightSummary], beside: Beside
) -> Comparison:
    """Return what the gate says, neighbours of new types flown."""
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
    """Whether a gate would fail that believes each new type that shows, whatever its p-value."""
    rates = holm_adjusted([found.violations.p, found.aborts.p])
    return min(rates) <= LEVEL or any(each.is_supported for each in found.new_types)


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarms:
    """How many of the draws failed: the gate, one without correction, one in a hostile world."""

    gate: int
    uncorrected: int
    hostile: int


def false_alarms(stack: Stack, budget: int, part: float, draws: int, rng: Random) -> Alarms:
    """Count failures of a stack that did not change.

    The neighbours of a flight drawn anew are drawn anew as well; in the hostile world all of them
    fail as it does.
    """
    counts = Counter[str]()
    chance, always = by_chance(stack, rng), alike(1.0, rng)
    for _ in range(draws):
        base = stack.draw(budget, rng)
        head = shaken(base, part, stack, rng)
        found = gated(base, head, chance)
        counts["gate"] += not found.passed
        counts["uncorrected"] += uncorrected(found)
        hostile = gated(base, head, always) if found.new_types else found
        counts["hostile"] += not hostile.passed
    return Alarms(gate=counts["gate"], uncorrected=counts["uncorrected"], hostile=counts["hostile"])


def detected(
    stack: Stack,
    budget: int,
    part: float,
    worse: float,
    into: FlightSummary,
    robust: float,
    draws: int,
    rng: Random,
) -> int:
    """Count failures of a stack ``worse`` of whose flights became violations, a part shaken.

    Each neighbour of a violation of the new type fails alike with the probability ``robust``.
    """
    beside = alike(robust, rng)
    failed = 0
    for _ in range(draws):
        base = stack.draw(budget, rng)
        head = worsened(shaken(base, part, stack, rng), worse, into, rng)
        failed += not gated(base, head, beside).passed
    return failed


def alarm_table(draws: int, rng: Random) -> Iterator[str]:
    """Yield the table of false alarms, line by line."""
    named = list(stacks())
    names = [each.name for each in named]
    yield f"| flights | drawn anew | {' | '.join(names)} | {names[1]}, and four rare types |"
    yield "| --- " * (len(named) + 3) + "|"
    for budget in BUDGETS:
        for part in SHAKEN:
            cells = []
            for stack in (*named, named[1].with_rare(budget)):
                found = false_alarms(stack, budget, part, draws, rng)
                others = ", ".join(
                    f"{100 * count / draws:.1f}" for count in (found.uncorrected, found.hostile)
                )
                cells.append(f"{share(found.gate, draws)}; {others}")
            yield f"| {budget} | {100 * part:.0f} % | {' | '.join(cells)} |"


def power_table(draws: int, rng: Random) -> Iterator[str]:
    """Yield the table of what is detected, line by line."""
    stack = measured("MM-MLS", "random")
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
                share(detected(stack, budget, part, worse, into, robust, draws, rng), draws)
                for _, worse, into, robust in columns
            ]
            yield f"| {budget} | {100 * part:.0f} % | {' | '.join(cells)} |"


def write(draws: int) -> None:
    """Write both tables into the page, between its two marks."""
    rng = np.random.default_rng(0)
    tables = [
        f"False alarms in {draws} draws each:",
        "\n".join(alarm_table(draws, rng)),
        f"Failures of a stack that is worse, MM-MLS in random scenarios, {draws // 4} draws each:",
        "\n".join(power_table(draws // 4, rng)),
    ]
    text = PAGE.read_text()
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(before + BEGIN + "\n" + "\n\n".join(tables) + "\n\n" + END + after)
