"""Geometry of the index's charts: shares as a bar, curves of numbers over flights."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from pytest_garl.reports.search_summary import LEGEND, SearchSummary
from pytest_garl.reports.shares_text import percent

SIDE = 100.0
"""Charts are drawn on a square of this side; the page stretches it."""
MOST_COLOURS = 8
IDLE = "idle"
"""The colour of flights in which nobody could have landed."""
_NAMES = {
    "landed": "landed as it should",
    IDLE: "did not land, excused or blocked",
    "inconclusive": "inconclusive",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A part of a bar: its class in the style sheet, where it lies, what it says."""

    kind: str
    left: float
    width: float
    count: int
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A line through points of the square, with the number at its end."""

    name: str
    colour: int
    dash: int
    points: str
    last: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """Curves with the ticks of both axes, from low to high."""

    curves: tuple[Curve, ...]
    flights: int
    highest: int
    ticks: tuple[int, ...]

    @property
    def gridlines(self) -> tuple[float, ...]:
        """Heights of the ticks on the square, from the top down."""
        return tuple(SIDE * (1 - tick / self.highest) for tick in self.ticks)


def outcome_bar(search: SearchSummary) -> tuple[Segment, ...]:
    """Return how the flights of a search ended, each in one part of a bar."""
    own = {
        slot for kind in search.kinds if kind.signature.startswith("own:") for slot in kind.slots
    }
    counts: dict[str, int] = {}
    for flight in search.flights:
        verdict, kind = flight.result.verdict, "landed"
        if flight.result.inconclusive:
            kind = "inconclusive"
        elif verdict.violation_type:
            kind = verdict.violation_type
        elif flight.id.slot_id in own:
            kind = "own"
        elif flight.result.outcome != "landed":
            kind = IDLE
        counts[kind] = counts.get(kind, 0) + 1
    order = ["landed", IDLE, *LEGEND, "inconclusive"]
    total, left, found = len(search.flights), 0.0, []
    for kind in sorted(counts, key=order.index):
        width = SIDE * counts[kind] / total
        meaning = _NAMES.get(kind) or f"{kind}: {LEGEND[kind]}"
        text = f"{meaning}: {counts[kind]} ({percent(counts[kind], total)})"
        found.append(
            Segment(
                kind=kind,
                left=round(left, 3),
                width=round(width, 3),
                count=counts[kind],
                text=text,
            )
        )
        left += width
    return tuple(found)


def kinds_over_flights(searches: Sequence[SearchSummary]) -> Plot | None:
    """Return how many kinds of violation each search had found after so many flights."""
    numbers = []
    for search in searches:
        seen: set[str] = set()
        counts = [0]
        for flight in search.flights:
            if flight.result.verdict.violation:
                seen.add(flight.signature)
            counts.append(len(seen))
        numbers.append(counts)
    return _plot([f"{each.name} on {each.map}" for each in searches], numbers)


def violations_over_flights(searches: Sequence[SearchSummary]) -> Plot | None:
    """Return how many flights of each search had violated something after so many flights."""
    numbers = []
    for search in searches:
        counts = [0]
        for flight in search.flights:
            counts.append(counts[-1] + flight.result.verdict.violation)
        numbers.append(counts)
    return _plot([f"{each.name} on {each.map}" for each in searches], numbers)


def _plot(names: Sequence[str], numbers: Sequence[Sequence[int]]) -> Plot | None:
    longest = max((len(each) - 1 for each in numbers), default=0)
    if not longest:
        return None
    most = max(1, *(each[-1] for each in numbers))
    spacing = next(
        step * 10**power
        for power in range(9)
        for step in (1, 2, 5)
        if most / (step * 10**power) <= 5
    )
    highest = -(-most // spacing) * spacing
    curves = tuple(
        Curve(
            name=name,
            colour=index % MOST_COLOURS + 1,
            dash=index // MOST_COLOURS % 3,
            points=_points(counts, longest, highest),
            last=counts[-1],
        )
        for index, (name, counts) in enumerate(zip(names, numbers, strict=True))
    )
    return Plot(
        curves=curves,
        flights=longest,
        highest=highest,
        ticks=tuple(range(0, highest + 1, spacing)),
    )


def _points(counts: Sequence[int], longest: int, highest: int) -> str:
    """Return a staircase as SVG points: a number holds until the flight that changes it."""
    points = [(0, counts[0])]
    for flight, (before, after) in enumerate(itertools.pairwise(counts), start=1):
        if after != before:
            points += [(flight, before), (flight, after)]
    points.append((len(counts) - 1, counts[-1]))
    return " ".join(f"{SIDE * x / longest:.2f},{SIDE * (1 - y / highest):.2f}" for x, y in points)
