"""Forecast the flights that follow a search, and their time."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.regressions.case_flights import ESCAPE_FLIGHTS
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.investigation import EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS

SPENT_SHARE = 0.85
"""Share of its flights that a kind of violation spends: many need fewer than they may have.  With
it the forecast was 1.07 and 1.31 times the measured time (the tutorial's system, six kinds)."""


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
    own = SPENT_SHARE * each
    if cap is None or kinds * own <= cap:
        return kinds * (1 + own)
    return kinds + max(own, cap)


def seconds_per_new_signature(each: int, flight_s: float, workers: int) -> float:
    """Return how long one of several new kinds of violation takes."""
    return (1 + SPENT_SHARE * each) * flight_s / max(1, workers)


def remaining_work(
    requests: Sequence[CaseRequest], flight_s: Mapping[str, float], workers: int
) -> RemainingWork:
    """Return the work of all requests; ``flight_s`` is the time of a flight of each, by name."""
    flights, each_s = 0.0, []
    left: dict[str, float] = {each.search: float(each.cap or 0) for each in requests}
    divided = divide_flights(requests)
    for request in sorted(divided, key=lambda each: not each.budget):
        budget = request.budget
        least = least_flights(request)
        if not budget and left[request.search] >= least:
            # It gets the flights that others do not need.
            budget = least
        if not budget:
            continue
        own = 1.0 if request.is_exception else SPENT_SHARE * budget
        left[request.search] -= own
        flights += own
        each_s.append(own * flight_s[request.name])
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
        most = [EXCEPTION_FLIGHTS if each.is_exception else each.budget for each in own]
        given = most
        if own[0].cap is not None:
            left = own[0].cap - sum(each.flights for each in before)
            least = [min(most, least_flights(each)) for most, each in zip(most, own, strict=True)]
            given = _divide(least, most, max(left, 0 if before else most[0]))
        divided += [
            dataclasses.replace(each, budget=flights)
            for each, flights in zip(own, given, strict=True)
        ]
    return tuple(divided)


def least_flights(request: CaseRequest) -> int:
    """Return the fewest flights that can confirm a violation of its kind."""
    if request.is_exception:
        return EXCEPTION_FLIGHTS
    return MINIMUM_CASE_FLIGHTS - (0 if request.asks_prevention else ESCAPE_FLIGHTS)


def _divide(least: Sequence[int], most: Sequence[int], flights: int) -> list[int]:
    """Return how many of ``flights`` each has, from its least to its most, or none.

    The rest is spread evenly if all have something.  If some have nothing, the rest is kept for
    them, together with the flights that the others do not spend.
    """
    given = []
    for needed in least:
        given.append(needed if needed <= flights else 0)
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
