"""Forecast the flights that follow a search, and their time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.triage.allowance import least_flights, most_flights

SPENT_SHARE = 0.85
"""Share of its flights that a kind of violation spends: many need fewer than they may have.  With
it the forecast was 1.07 and 1.31 times the measured time (the tutorial's system, six kinds)."""


REPEATED_SHARE = 0.1
"""Kinds of violation per flight of a search: four to eight in forty flights of OpenCV-MLS."""


RARER = 0.6
"""Kinds per flight later in a search by those so far: 11 in 80 flights after 7 in 30, or so."""
PRIOR_SHARE, PRIOR_FLIGHTS = 0.1, 12
"""What the first flights must outweigh: between no kind and eight in forty flights."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RemainingWork:
    """The flights that follow a search, and the time that they take."""

    at_most: int
    flights: float
    seconds: float


def expected_kinds(found: int, flown: int, wanted: int) -> float:
    """Return how many new kinds a search will have found, after some of its flights.

    It is the share so far, as if ``PRIOR_FLIGHTS`` had been flown before with ``PRIOR_SHARE`` of
    new kinds.  New kinds get rarer: the flights that are left find ``RARER`` as many.
    """
    share = (found + PRIOR_SHARE * PRIOR_FLIGHTS) / (flown + PRIOR_FLIGHTS)
    return found + RARER * share * max(0, wanted - flown)


def flights_after_search(kinds: float, each: int, cap: int | None) -> float:
    """Return the flights that the new kinds of a search take, with those that confirm them."""
    if not kinds or not each:
        return 0.0
    own = SPENT_SHARE * each
    if cap is None or kinds * own <= cap:
        return kinds * (1 + own)
    return kinds + max(own, cap)


def flight_times_with_shrinking(search: int, each: int, workers: int) -> float:
    """Return how many times one flight's time a search with the default cap takes, all included.

    Before it begins nobody knows how many kinds it will find.  With none it takes its own flights.
    With many it takes up to as many again for shrinking, and one for each to see whether it
    repeats, which is about a tenth; or the flights of the last kind, which follow each other, if
    that is longer.  The geometric mean of both is wrong by a factor of 1.5 at most, if the search
    has at least as many flights for each worker as one kind.
    """
    least = search / workers
    if not each:
        return least
    shared = (search + max(search, each) + REPEATED_SHARE * search) / workers
    return math.sqrt(least * max(shared, least + SPENT_SHARE * each))


def seconds_per_new_signature(each: int, flight_s: float) -> float:
    """Return how long a new kind of violation takes: its flights follow each other."""
    return (1 + SPENT_SHARE * each) * flight_s


def remaining_work(
    running: Sequence[tuple[CaseRequest, int]],
    waiting: Sequence[CaseRequest],
    left: Mapping[str, int | None],
    flight_s: Mapping[str, float],
    workers: int,
) -> RemainingWork:
    """Return the work that follows a search.

    ``running`` are requests with the flights that they have requested already.  ``waiting`` are
    those that have none; ``left`` are the flights that they may have, by search, None without cap.
    ``flight_s`` is the time of a flight of each, by name.
    """
    flights: dict[str, float] = {}
    unspent = dict.fromkeys(left, 0.0)
    at_most = 0
    for request, requested in running:
        own = 1.0 if request.is_exception else SPENT_SHARE * request.budget
        flights[request.name] = max(1.0, own - requested)
        unspent[request.search] += request.budget - max(own, requested)
        at_most += request.budget - requested
    for search, rest in left.items():
        own_requests = [each for each in waiting if each.search == search]
        most = sum(most_flights(each) for each in own_requests)
        at_most += most if rest is None else min(most, rest)
        free = float("inf") if rest is None else rest + unspent[search]
        for request in own_requests:
            if least_flights(request) <= free:
                given = min(most_flights(request), free)
                flights[request.name] = 1.0 if request.is_exception else SPENT_SHARE * given
                free -= flights[request.name]
    # Flights of one kind follow each other; those of several kinds are flown side by side.
    each_s = [count * flight_s[name] for name, count in flights.items()]
    seconds = max([math.fsum(each_s) / max(1, workers), *each_s], default=0.0)
    return RemainingWork(at_most=at_most, flights=math.fsum(flights.values()), seconds=seconds)
