"""Relative limits: whether landings became clearly less accurate or slower, within the limits."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pytest_garl.gate.gate_statistics import can_reject, signed_rank_p
from pytest_garl.gate.pairs import FlightSummary, Pair

ROUNDING = 9
"""Decimal digits of a difference: sums of the same decimal values shall tie."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeLimit:
    """By how much a landing may be worse than its base: by ``share`` of it, or by ``least``.

    Values are in ``unit``.
    """

    what: Literal["distance", "time"]
    unit: str
    share: float
    least: float
    worse: str

    @property
    def text(self) -> str:
        """The limit in words."""
        return f"{100 * self.share:g} % and {self.least:g} {self.unit}"

    def value(self, flight: FlightSummary) -> float | None:
        """Return the flight's distance or time; None without a landing within the limits."""
        if not flight.landed:
            return None
        return flight.distance_m if self.what == "distance" else flight.time_s

    def excess(self, before: float, after: float) -> float:
        """Return by how much ``after`` is worse than the limit allows; negative within it."""
        return round(after - before - max(self.share * before, self.least), ROUNDING)


LIMITS = (
    RelativeLimit(what="distance", unit="m", share=0.25, least=0.05, worse="less accurate"),
    RelativeLimit(what="time", unit="s", share=0.1, least=1.0, worse="slower"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeChange:
    """Distances or times before and after, of the ``pairs`` that landed twice.

    ``worst`` is the pair with the largest excess over the limit.  ``worse`` counts the pairs whose
    head is worse than the limit allows, ``better`` those whose base is.  ``p`` is that of
    :func:`signed_rank_p` for the excesses; ``adjusted`` is ``p`` after Holm's correction, None if
    too few pairs differ to fail the gate.
    """

    limit: RelativeLimit
    pairs: int
    medians: tuple[float, float]
    worsts: tuple[float, float]
    worst: tuple[str, float, float]
    worse: int
    better: int
    p: float
    adjusted: float | None = None

    def can_fail(self, level: float) -> bool:
        """Return whether enough pairs differ by more than the limit to fail the gate.

        Each of these pairs is an excess in one of its two orders, and the others in none.
        """
        return can_reject(self.worse + self.better, level)


def relative_changes(pairs: Sequence[Pair]) -> tuple[RelativeChange, ...]:
    """Return the changes of distance and time, uncorrected; none without a pair to compare."""
    changes = (_relative_change(limit, pairs) for limit in LIMITS)
    return tuple(change for change in changes if change is not None)


def _relative_change(limit: RelativeLimit, pairs: Sequence[Pair]) -> RelativeChange | None:
    compared = [
        (pair.name, before, after)
        for pair in pairs
        if (before := limit.value(pair.base)) is not None
        and (after := limit.value(pair.head)) is not None
    ]
    if not compared:
        return None
    befores = [before for _, before, _ in compared]
    afters = [after for _, _, after in compared]
    excesses = [limit.excess(before, after) for _, before, after in compared]
    return RelativeChange(
        limit=limit,
        pairs=len(compared),
        medians=(statistics.median(befores), statistics.median(afters)),
        worsts=(max(befores), max(afters)),
        worst=compared[excesses.index(max(excesses))],
        worse=sum(excess > 0 for excess in excesses),
        better=sum(limit.excess(after, before) > 0 for _, before, after in compared),
        p=signed_rank_p(excesses),
    )
