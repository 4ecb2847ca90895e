"""The first violations of each signature, found as soon as their generation is flown."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

from pytest_garl.execution.ledger_queries import LedgerFlight, LedgerQueries


class FirstViolations:
    """Follows searches, generation by generation.

    The violations of the generation in which a signature occurs first are known as soon as this
    generation and all before it are flown.  They are the same for any number of workers and in a
    resumed run.
    """

    def __init__(self, queries: LedgerQueries) -> None:
        self._queries = queries
        self._latest: dict[str, int] = {}
        """The last generation of each search that was looked at."""
        self._seen: defaultdict[str, set[str]] = defaultdict(set)
        """The signatures of each search."""

    def advance(
        self, search: str, counts: Callable[[LedgerFlight], bool] = lambda flight: True
    ) -> dict[str, list[LedgerFlight]]:
        """Return, by signature, the first violations of those new since this was called last.

        The signatures are in the order in which they are found, their flights in that of the slots.
        Only flights that ``counts`` counts are looked at.
        """
        found: dict[str, list[LedgerFlight]] = {}
        for generation in self._queries.closed_generations(search, self._latest.get(search, -1)):
            self._latest[search] = generation
            seen = frozenset(self._seen[search])
            for flight in self._queries.violating(search, generation):
                if flight.signature not in seen and counts(flight):
                    found.setdefault(flight.signature, []).append(flight)
            self._seen[search].update(found)
        return found
