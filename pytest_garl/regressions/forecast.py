"""How long a search will take, and what follows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.regressions.case_request import CaseRequest
from pytest_garl.regressions.follow_up import shares
from pytest_garl.regressions.investigation import LEAST, PILOTS

SPENT = 0.85
"""Share of its flights that a kind of violation spends: many stop before the last is needed.  With
it the forecast was 1.07 and 1.31 times what came (the tutorial's system, six kinds)."""
PILOTED = 2
"""Flights of the reference pilot for a kind."""
PILOTED_S = 0.2
"""What such a flight takes of the time of another: it needs no camera."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RemainingWork:
    """What is to come after a search: flights, and the time that they take."""

    flights: float
    seconds: float


def flights_after_search(kinds: int, each: int, cap: int | None) -> float:
    """Return the flights that the new kinds of a search take, those that repeat them included."""
    if not kinds or not each:
        return 0.0
    own = SPENT * (each - PILOTS)
    least = SPENT * (LEAST - PILOTS)
    if cap is None or kinds * own <= cap:
        return kinds * (1 + own + PILOTED)
    reached = max(1, min(kinds, int(cap / least)))
    return kinds + max(own, min(reached * own, cap)) + reached * PILOTED


def seconds_of_kind(each: int, flight_s: float, workers: int) -> float:
    """Return how long one of several new kinds of violation takes."""
    flights = 1 + SPENT * (each - PILOTS) + PILOTED * PILOTED_S
    return flights * flight_s / max(1, workers)


def remaining_work(
    wanted: Sequence[CaseRequest], flight_s: Mapping[str, float], workers: int
) -> RemainingWork:
    """Return what signatures still take; ``flight_s`` is how long a flight of each takes."""
    flights, each_s = 0.0, []
    left: dict[str, float] = {each.search: float(each.cap or 0) for each in wanted}
    for request in sorted(shares(wanted), key=lambda each: not each.budget):
        budget = request.budget
        if not budget and left[request.search] >= LEAST - PILOTS:
            # Others leave something for it.
            budget = LEAST
        if not budget:
            continue
        own = 1.0 if request.exception else SPENT * (budget - PILOTS)
        piloted = 0 if request.exception else PILOTED
        left[request.search] -= own
        flights += own + piloted
        each_s.append((own + piloted * PILOTED_S) * flight_s[request.name])
    # Flights of one kind follow each other; those of several are flown side by side.
    seconds = max([sum(each_s) / max(1, workers), *each_s], default=0.0)
    return RemainingWork(flights=flights, seconds=seconds)
