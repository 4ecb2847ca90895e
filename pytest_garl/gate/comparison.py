"""Compare two landing systems pair by pair on the same scenarios, and decide whether one is worse.

Both systems fly every scenario, so each scenario is a pair.  Pairs with equal results say nothing
about which system is better; pairs that broke stand against pairs that were fixed.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pytest_garl.gate.gate_statistics import CONFIRMED_PAIRS, holm_adjusted
from pytest_garl.gate.new_types import (
    NeighbourFlights,
    NewType,
    new_signatures,
    new_types,
)
from pytest_garl.gate.pairs import Pair, PairResult
from pytest_garl.gate.rates import RateChange, rate_changes
from pytest_garl.gate.relative import RelativeChange, relative_changes

LEVEL = 0.05
"""Default probability that the gate fails a landing system that is no worse, per system and map."""
LARGEST_INCONCLUSIVE_SHARE = 0.05
"""The gate fails if more of the baseline's flights, and more than one, were inconclusive."""
RARE_FLIGHTS = 5
"""A type in more flights of the base than this is hardly missed by chance: a type expected in six
flights occurs in none of them once in four hundred times."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two landing systems on the same scenarios.

    ``pairs`` are those that both decided.  ``undecided`` are those that only the base decided;
    ``left_out`` counts those that the base did not decide.  No figure includes these two.
    ``rates`` are those of :func:`rate_changes`, ``sizes`` those of :func:`relative_changes`.
    ``new_signatures`` are signatures that the base lacks although it has their types, with their
    pairs.  ``unsure`` names the pairs of new types with an inconclusive neighbour.  ``tests`` is
    the number of p-values that were corrected together.
    """

    pairs: tuple[Pair, ...]
    undecided: tuple[Pair, ...]
    left_out: int
    rates: tuple[RateChange, RateChange, RateChange]
    sizes: tuple[RelativeChange, ...]
    new_types: tuple[NewType, ...]
    new_signatures: tuple[tuple[str, tuple[Pair, ...]], ...]
    unsure: tuple[str, ...]
    tests: int
    level: float

    @property
    def violations(self) -> RateChange:
        """The change of the number of flights that violate a property."""
        return self.rates[0]

    @property
    def grave(self) -> RateChange:
        """The change of violations other than no landing, where both flights violate."""
        return self.rates[1]

    @property
    def safe_aborts(self) -> RateChange:
        """The change of ends without landing or violation, where neither flight violates."""
        return self.rates[2]

    @property
    def passed(self) -> bool:
        """Whether the gate passes."""
        return not self.failure_reasons

    def with_result(self, result: PairResult) -> tuple[Pair, ...]:
        """Return the pairs with one result."""
        return tuple(pair for pair in self.pairs if pair.result == result)

    @property
    def pairs_to_confirm(self) -> tuple[Pair, ...]:
        """The pairs whose neighbours show whether a new type is real."""
        return tuple(pair for each in self.new_types for pair in each.pairs[:CONFIRMED_PAIRS])

    @property
    def failure_reasons(self) -> tuple[str, ...]:
        """Why the gate fails; empty if it passes."""
        found = [
            f"significantly more {change.what}: {self._significance(change)}"
            for change in self.rates
            if self.is_significant(change)
        ]
        found += [
            f"landings significantly {change.limit.worse}: {self._significance(change)}"
            for change in self.sizes
            if self.is_significant(change)
        ]
        found += [
            f"new type of violation: {each.text}"
            for each in self.new_types
            if each.is_supported and self.is_significant(each)
        ]
        flown = len(self.pairs) + len(self.undecided) + self.left_out
        if self.left_out > max(1, LARGEST_INCONCLUSIVE_SHARE * flown):
            found.append(
                f"{self.left_out} of {flown} flights of the baseline were inconclusive; "
                "save it anew"
            )
        if self.undecided:
            found.append(f"inconclusive: {names_of(self.undecided)}")
        if self.unsure:
            found.append(f"neighbours inconclusive: {', '.join(self.unsure)}")
        return tuple(found) if self.pairs or found else ("no pair could be compared",)

    def is_significant(self, test: RateChange | RelativeChange | NewType) -> bool:
        """Return whether a test fails at the gate's level, after the correction for all tests."""
        return test.adjusted is not None and test.adjusted <= self.level

    def _significance(self, change: RateChange | RelativeChange) -> str:
        assert change.adjusted is not None
        return f"p {p_text(change.adjusted)} at level {self.level:g}"


def compare(
    pairs: Sequence[Pair],
    *,
    level: float = LEVEL,
    expected_signatures: Collection[str] = (),
    neighbours: NeighbourFlights = MappingProxyType({}),
) -> Comparison:
    """Return how the head compares with the base.

    A type is new if no flight of the base and none of the ``expected_signatures`` has it.

    Holm's step-down correction covers all tests: the rates, the sizes, and each type that is new,
    or rare in the base.  It makes ``level`` that of the gate and not of each test (Holm 1979,
    Scandinavian Journal of Statistics 6(2)).  A rate or a size in which too few pairs differ to
    reach the level is no test.
    """
    decided = tuple(pair for pair in pairs if pair.base.decided and pair.head.decided)
    base_types = Counter(pair.base.type for pair in decided if pair.base.violated)
    rates, sizes = rate_changes(decided), relative_changes(decided)
    found = new_types(decided, expected_signatures, neighbours)
    # A rare type of the base might have looked new as well, so it counts as a test that passed.
    rare = sum(count <= RARE_FLIGHTS for count in base_types.values())
    tested = [
        *(change.p for change in rates if change.can_fail(level)),
        *(change.p for change in sizes if change.can_fail(level)),
    ]
    p_values = [*tested, *(each.p for each in found), *[1.0] * rare]
    adjusted = iter(holm_adjusted(p_values))
    more, graver, safer = (
        dataclasses.replace(change, adjusted=next(adjusted)) if change.can_fail(level) else change
        for change in rates
    )
    sizes = tuple(
        dataclasses.replace(change, adjusted=next(adjusted)) if change.can_fail(level) else change
        for change in sizes
    )
    found = [dataclasses.replace(each, adjusted=next(adjusted)) for each in found]
    return Comparison(
        pairs=decided,
        undecided=tuple(pair for pair in pairs if pair.base.decided and not pair.head.decided),
        left_out=sum(not pair.base.decided for pair in pairs),
        rates=(more, graver, safer),
        sizes=sizes,
        new_types=tuple(found),
        new_signatures=new_signatures(decided, expected_signatures, base_types),
        unsure=tuple(
            name for name, flown in neighbours.items() if not all(each.decided for each in flown)
        ),
        tests=len(p_values),
        level=level,
    )


def names_of(pairs: Sequence[Pair]) -> str:
    """Return the names of the first three pairs, and the number of the others."""
    named = ", ".join(pair.name for pair in pairs[:3])
    return f"{named} and {len(pairs) - 3} more" if len(pairs) > 3 else named


def p_text(value: float) -> str:
    """Return a p-value with the digits that matter."""
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1e}"
