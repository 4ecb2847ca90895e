"""Violation types that only the changed landing system shows, and whether that can be chance."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from pytest_garl.gate.gate_statistics import new_type_p
from pytest_garl.gate.pairs import FlightSummary, Pair, violation_type_of

PAIRS_FOR_SUPPORT = 2
"""A new type is supported by this number of pairs ..."""
NEIGHBOURS_FOR_SUPPORT = 2
"""... or by one pair of which this number of neighbours fail with the same type."""
NeighbourFlights = Mapping[str, Sequence[FlightSummary]]
"""Flights of the head in the neighbours of a scenario, by the name of the scenario's pair."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NewType:
    """A violation type that no flight of the base has; ``pairs`` are those whose head has it.

    ``neighbours`` holds, for each pair whose neighbours were flown, the number of neighbours that
    fail with this type and the number flown.  ``p`` is that of :func:`new_type_p`; ``adjusted`` is
    ``p`` after Holm's correction.
    """

    type: str
    pairs: tuple[Pair, ...]
    neighbours: tuple[tuple[int, int], ...]
    p: float
    adjusted: float | None = None

    @property
    def is_supported(self) -> bool:
        """Whether two pairs show the type, or one pair whose neighbours fail in the same way."""
        confirmed = any(failing >= NEIGHBOURS_FOR_SUPPORT for failing, _ in self.neighbours)
        return confirmed or len(self.pairs) >= PAIRS_FOR_SUPPORT

    @property
    def text(self) -> str:
        """The type, its pairs and the number of neighbours that fail in the same way."""
        first, more = self.pairs[0], len(self.pairs) - 1
        failing = sum(count for count, _ in self.neighbours)
        flown = sum(count for _, count in self.neighbours)
        neighbours = f", in {failing} of {flown} neighbours" if flown else ""
        return f"{self.type} in {first.name}{f' and {more} more' if more else ''}{neighbours}"


def new_types(
    pairs: Sequence[Pair], expected: Collection[str], neighbours: NeighbourFlights
) -> list[NewType]:
    """Return the types that only the head has; their p-values are not yet corrected.

    A pair that is fixed shows no new way to fail: a collision that became a needless abort
    is milder, though its type may be new.
    """
    old_types = {pair.base.type for pair in pairs} | {violation_type_of(each) for each in expected}
    changed = sum(not pair.identical for pair in pairs)
    found = []
    failed = [pair for pair in pairs if pair.result != "fixed"]
    for new_type in sorted({pair.head.type for pair in failed} - old_types - {""}):
        having = tuple(pair for pair in failed if pair.head.type == new_type)
        failing = tuple(
            (sum(each.type == new_type for each in flown), len(flown))
            for pair in having
            if (flown := neighbours.get(pair.name))
        )
        p = new_type_p(
            base=len(pairs),
            changed=changed,
            found=len(having),
            neighbours_each=max((flown for _, flown in failing), default=0),
            failing=sum(count for count, _ in failing),
        )
        found.append(NewType(type=new_type, pairs=having, neighbours=failing, p=p))
    return found


def new_signatures(
    pairs: Sequence[Pair], expected: Collection[str], base_types: Collection[str]
) -> tuple[tuple[str, tuple[Pair, ...]], ...]:
    """Return the signatures that only the head has, of types that are not new, with their pairs."""
    old = {pair.base.signature for pair in pairs} | {*expected}
    types = {*base_types, *(violation_type_of(each) for each in expected)}
    found = sorted({pair.head.signature for pair in pairs if pair.head.type in types} - old)
    return tuple(
        (each, tuple(pair for pair in pairs if pair.head.signature == each)) for each in found
    )
