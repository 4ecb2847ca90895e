"""Geometry of the index's charts: shares as a bar, curves of numbers over flights."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from pytest_garl.reports.run_record import IDLE, INCONCLUSIVE, LANDED, SearchRecord
from pytest_garl.reports.run_text import LEGEND, legend_of, percent

SIDE = 100.0
"""Charts are drawn on a square of this side; the page stretches it."""
MOST_COLOURS = 8
_NAMES = {
    LANDED: "landed as it should",
    IDLE: "did not land, excused or blocked",
    INCONCLUSIVE: "inconclusive",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A part of a bar that is ``SIDE`` long: its class in the style sheet, place and text."""

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


def outcome_bar(search: SearchRecord) -> tuple[Segment, ...]:
    """Return how the flights of a search ended, each in one part of a bar."""
    order = [LANDED, IDLE, *LEGEND, INCONCLUSIVE]
    meanings = legend_of(kind.signature for kind in search.kinds)
    left, found = 0.0, []
    for kind, count in sorted(search.ends.items(), key=lambda each: order.index(each[0])):
        width = SIDE * count / search.flown
        meaning = _NAMES.get(kind) or f"{kind}: {meanings[kind]}"
        text = f"{meaning}: {count} ({percent(count, search.flown)})"
        found.append(
            Segment(kind=kind, left=round(left, 3), width=round(width, 3), count=count, text=text)
        )
        left += width
    return tuple(found)


def kinds_over_flights(searches: Sequence[SearchRecord]) -> Plot | None:
    """Return how many kinds of violation each search had found after each number of flights."""
    return _plot(searches, [each.kinds_over_flights for each in searches])


def violations_over_flights(searches: Sequence[SearchRecord]) -> Plot | None:
    """Return how many violations each search had found after each number of flights."""
    return _plot(searches, [each.violations_over_flights for each in searches])


def _plot(searches: Sequence[SearchRecord], numbers: Sequence[Sequence[int]]) -> Plot | None:
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
            name=search.name,
            colour=index % MOST_COLOURS + 1,
            dash=index // MOST_COLOURS % 3,
            points=_points(counts, longest, highest),
            last=counts[-1],
        )
        for index, (search, counts) in enumerate(zip(searches, numbers, strict=True))
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
