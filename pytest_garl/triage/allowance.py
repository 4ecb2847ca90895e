"""How many flights the new signatures of a search may have, to be confirmed and shrunk."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.shrinking.plan import ESCAPE_FLIGHTS, EXCEPTION_FLIGHTS, FEWEST_FOR_VIOLATION


@dataclass(frozen=True, slots=True, kw_only=True)
class ShrinkBudget:
    """The flights for each new signature, and whether a search's signatures have a cap together.

    The cap is as many flights of the landing system as the search itself; one signature is always
    shrunk.
    """

    each: int
    capped: bool


def most_flights(request: CaseRequest) -> int:
    """Return how many flights a request gets if there are enough."""
    return EXCEPTION_FLIGHTS if request.is_exception else request.budget


def least_flights(request: CaseRequest) -> int:
    """Return the fewest flights that can confirm a violation of its kind."""
    if request.is_exception:
        return EXCEPTION_FLIGHTS
    least = FEWEST_FOR_VIOLATION - (0 if request.asks_prevention else ESCAPE_FLIGHTS)
    return min(least, request.budget)


class Allowance:
    """The flights that are left for the new signatures of one search; ``cap`` None is no limit.

    A request gets all that it may have.  If fewer are left, it gets those, unless they are too few
    to confirm the violation.  So what each gets depends on the order of the requests alone.  The
    first gets all in any case.
    """

    def __init__(self, cap: int | None) -> None:
        self.left = cap
        self._is_first = True

    def offer(self, request: CaseRequest) -> int:
        """Return how many flights a request would get."""
        most = most_flights(request)
        if self.left is None or self._is_first:
            return most
        return min(most, self.left) if least_flights(request) <= self.left else 0

    def take(self, request: CaseRequest) -> int:
        """Return how many flights a request gets, which are then no longer left."""
        given = self.offer(request)
        self._is_first = False
        self.give_back(-given)
        return given

    def give_back(self, flights: int) -> None:
        """Add flights that an investigation has not used."""
        if self.left is not None:
            self.left += flights
