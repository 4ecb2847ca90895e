"""Repeat flights, requested as soon as it is known what fails: idle workers fly them meanwhile."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from pytest_garl.execution.flight_id import Slot

if TYPE_CHECKING:
    from pytest_garl.plugin.run import Run

REFLIGHTS = 4
"""A violation of a system that need not be deterministic is flown so many times more."""


class EarlyReflights:
    """Requests the flights that will confirm the first violation of each signature.

    The test that fails for it reports when all lower slots have reported, which may be minutes
    later.  Nothing is decided here: a test that asks for the same flights finds them in the ledger.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._latest: dict[str, int] = {}
        """The last generation of each search that was looked at."""
        self._seen: defaultdict[str, set[str]] = defaultdict(set)
        """The signatures of each search."""

    def advance(self) -> None:
        """Request the flights for the generations that were flown since this was called last."""
        queries = self._run.ledger.queries
        for search in self._run.searches.breeders:
            for generation in queries.closed_generations(search, self._latest.get(search, -1)):
                self._latest[search] = generation
                for flight in queries.violating(search, generation):
                    if flight.signature not in self._seen[search]:
                        self._seen[search].add(flight.signature)
                        self._request(search, flight.id.slot, flight.signature)

    def _request(self, search: str, slot: Slot, signature: str) -> None:
        run = self._run
        target = run.searches.targets[search].get(slot)
        if target is None or signature in run.expected_signatures(target):
            return
        if any(item.shows for item in run.items.get(target.flight, ())):
            run.request_reflights(target, 1 if target.deterministic else REFLIGHTS)
