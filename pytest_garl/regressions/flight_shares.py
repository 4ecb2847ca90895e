"""Divide the flights that may follow a search among its new signatures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from pytest_garl.regressions.case_flights import PILOT_FLIGHTS
from pytest_garl.regressions.case_request import CaseRequest, CaseResult
from pytest_garl.regressions.investigation import EXCEPTION_FLIGHTS, MINIMUM_CASE_FLIGHTS


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
