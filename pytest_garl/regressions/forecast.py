"""Forecast the flights that follow a search, and their time."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.regressions.case_flights import PILOT_FLIGHTS
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.investigation import EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS

SPENT_SHARE = 0.85
"""Share of its flights that a kind of violation spends: many need fewer than they may have.  With
it the forecast was 1.07 and 1.31 times the measured time (the tutorial's system, six kinds)."""
USUAL_PILOT_FLIGHTS = 2
"""Flights that the reference pilot usually flies for a kind of violation."""
PILOT_TIME_SHARE = 0.2
"""Time of a flight of the reference pilot, as a share of another's: it needs no camera."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RemainingWork:
    """The flights that follow a search, and the time that they take."""

    at_most: int
    flights: float
    seconds: float


def flights_after_search(kinds: int, each: int, cap: int | None) -> float:
    """Return the flights that the new kinds of a search take, with those that confirm them."""
    if not kinds or not each:
        return 0.0
    own = SPENT_SHARE * (each - PILOT_FLIGHTS)
    least = SPENT_SHARE * (MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS)
    if cap is None or kinds * own <= cap:
        return kinds * (1 + own + USUAL_PILOT_FLIGHTS)
    reached = max(1, min(kinds, int(cap / least)))
    return kinds + max(own, min(reached * own, cap)) + reached * USUAL_PILOT_FLIGHTS


def seconds_per_new_signature(each: int, flight_s: float, workers: int) -> float:
    """Return how long one of several new kinds of violation takes."""
    own = SPENT_SHARE * (each - PILOT_FLIGHTS)
    flights = 1 + own + USUAL_PILOT_FLIGHTS * PILOT_TIME_SHARE
    return flights * flight_s / max(1, workers)


def remaining_work(
    requests: Sequence[CaseRequest], flight_s: Mapping[str, float], workers: int
) -> RemainingWork:
    """Return the work of all requests; ``flight_s`` is the time of a flight of each, by name."""
    flights, each_s = 0.0, []
    left: dict[str, float] = {each.search: float(each.cap or 0) for each in requests}
    divided = divide_flights(requests)
    for request in sorted(divided, key=lambda each: not each.budget):
        budget = request.budget
        if not budget and left[request.search] >= MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS:
            # It gets the flights that others do not need.
            budget = MINIMUM_CASE_FLIGHTS
        if not budget:
            continue
        own = 1.0 if request.is_exception else SPENT_SHARE * (budget - PILOT_FLIGHTS)
        by_pilot = 0 if request.is_exception else USUAL_PILOT_FLIGHTS
        left[request.search] -= own
        flights += own + by_pilot
        each_s.append((own + by_pilot * PILOT_TIME_SHARE) * flight_s[request.name])
    # Flights of one kind follow each other; those of several kinds are flown side by side.
    seconds = max([sum(each_s) / max(1, workers), *each_s], default=0.0)
    at_most = sum(each.budget for each in divided)
    return RemainingWork(at_most=at_most, flights=flights, seconds=seconds)


def divide_flights(
    requests: Sequence[CaseRequest], results: Mapping[str, CaseResult] | None = None
) -> tuple[CaseRequest, ...]:
    """Return requests with the flights that each may have.

    If a search's cap is too low for all of its signatures, as many as possible have enough, one in
    any case, and the others have none.  ``results`` are those of requests that had their flights,
    by name.
    """
    divided = []
    for search in dict.fromkeys(each.search for each in requests):
        before = [each for name, each in (results or {}).items() if name.startswith(f"{search} ")]
        own = [each for each in requests if each.search == search]
        # The reference pilot's flights take a fraction of the time and are not counted.
        most = [
            EXCEPTION_FLIGHTS if each.is_exception else each.budget - PILOT_FLIGHTS for each in own
        ]
        given = most
        if own[0].cap is not None:
            left = own[0].cap - sum(each.flights - each.pilot_flights for each in before)
            given = _divide(most, max(left, 0 if before else most[0]))
        divided += [
            dataclasses.replace(each, budget=_with_pilot(each, flights))
            for each, flights in zip(own, given, strict=True)
        ]
    return tuple(divided)


def _with_pilot(request: CaseRequest, flights: int) -> int:
    return flights if request.is_exception or not flights else flights + PILOT_FLIGHTS


def _divide(most: Sequence[int], flights: int) -> list[int]:
    """Return how many of ``flights`` each has, at most what it wants.

    The rest is spread evenly if all have something.  If some have nothing, the rest is kept for
    them, together with the flights that the others do not spend.
    """
    given = []
    for wanted in most:
        least = min(wanted, MINIMUM_CASE_FLIGHTS - PILOT_FLIGHTS)
        given.append(least if least <= flights else 0)
        flights -= given[-1]
    if sum(map(bool, given)) == 1:
        # A single signature is shrunk as well as possible.
        number = next(number for number, each in enumerate(given) if each)
        given[number] += min(most[number] - given[number], flights)
    elif all(given):
        while flights > 0 and given != [*most]:
            for number, wanted in enumerate(most):
                more = min(1, wanted - given[number], flights)
                given[number] += more
                flights -= more
    return given
