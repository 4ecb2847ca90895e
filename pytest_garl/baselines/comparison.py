"""Compare two landing systems pair by pair on the same scenarios, and decide whether one is worse.

Both systems fly every scenario, so each scenario is a pair.  Pairs with equal results say nothing
about which system is better; pairs that broke stand against pairs that were fixed.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pytest_garl.baselines.gate_statistics import (
    CONFIRMED_PAIRS,
    holm_adjusted,
    mcnemar_p,
    new_type_p,
)
from pytest_garl.baselines.pairs import (
    DIFFERENT_RESULTS,
    FlightSummary,
    Pair,
    PairResult,
    violation_type_of,
)

LEVEL = 0.05
"""Default probability that the gate fails a landing system that is no worse, per system and map."""
LARGEST_INCONCLUSIVE_SHARE = 0.05
"""The gate fails if more of the baseline's flights, and more than one, were inconclusive."""
RARE_FLIGHTS = 5
"""A type in more flights of the base than this is hardly missed by chance: a type expected in six
flights occurs in none of them once in four hundred times."""
PAIRS_LISTED = 20
"""Number of pairs of each result that a report lists."""
PAIRS_FOR_SUPPORT = 2
"""A new type is supported by this number of pairs ..."""
NEIGHBOURS_FOR_SUPPORT = 2
"""... or by one pair of which this number of neighbours fail with the same type."""
NeighbourFlights = Mapping[str, Sequence[FlightSummary]]
"""Flights of the head in the neighbours of a scenario, by the name of the scenario's pair."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RateChange:
    """A rate before and after: ``base`` and ``head`` are numbers of flights.

    ``broke`` counts the pairs where only the head has the event, ``fixed`` those where only the
    base has it.  ``p`` is that of :func:`mcnemar_p`; ``adjusted`` is ``p`` after Holm's correction.
    """

    what: str
    base: int
    head: int
    broke: int
    fixed: int
    p: float
    adjusted: float = 1.0


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
    adjusted: float = 1.0

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two landing systems on the same scenarios.

    ``pairs`` are those that both decided.  ``undecided`` are those that only the base decided;
    ``left_out`` counts those that the base did not decide.  No figure includes these two.
    ``new_signatures`` are signatures that the base lacks although it has their types, with their
    pairs.  ``unsure`` names the pairs of new types with an inconclusive neighbour.  ``tests`` is
    the number of p-values that were corrected together.
    """

    pairs: tuple[Pair, ...]
    undecided: tuple[Pair, ...]
    left_out: int
    violations: RateChange
    aborts: RateChange
    new_types: tuple[NewType, ...]
    new_signatures: tuple[tuple[str, tuple[Pair, ...]], ...]
    unsure: tuple[str, ...]
    tests: int
    level: float

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
            f"significantly more {change.what}: p {_p(change.adjusted)} at level {self.level:g}"
            for change in (self.violations, self.aborts)
            if change.adjusted <= self.level
        ]
        found += [
            f"new type of violation: {each.text}" for each in self.new_types if self._fails(each)
        ]
        flown = len(self.pairs) + len(self.undecided) + self.left_out
        if self.left_out > max(1, LARGEST_INCONCLUSIVE_SHARE * flown):
            found.append(
                f"{self.left_out} of {flown} flights of the baseline were inconclusive; "
                "save it anew"
            )
        if self.undecided:
            found.append(f"inconclusive: {_names(self.undecided)}")
        if self.unsure:
            found.append(f"neighbours inconclusive: {', '.join(self.unsure)}")
        return tuple(found) if self.pairs or found else ("no pair could be compared",)

    def _fails(self, new: NewType) -> bool:
        return new.is_supported and new.adjusted <= self.level

    def summary_lines(self) -> Iterator[str]:
        """Yield whether the gate passes, then lines about the rates and what is new."""
        yield "gate passed" if self.passed else f"gate FAILED: {'; '.join(self.failure_reasons)}"
        identical = sum(pair.identical for pair in self.pairs)
        yield f"{len(self.pairs)} pairs compared, {identical} of them the same flight to the byte"
        if self.left_out:
            yield f"{self.left_out} left out: inconclusive when the baseline was saved"
        for change, broke, fixed in (
            (self.violations, "broke", "fixed"),
            (self.aborts, "landings lost", "landings won"),
        ):
            yield (
                f"{change.what} {change.base} -> {change.head} ({change.broke} {broke}, "
                f"{change.fixed} {fixed}): {self._p_values(change)}"
            )
        for new in self.new_types:
            doubt = "" if self._fails(new) else ": may be chance, look at it"
            yield f"new type of violation: {new.text}: {self._p_values(new)}{doubt}"
        for signature, pairs in self.new_signatures:
            yield f"new kind of a known type, not gated: {signature} in {_names(pairs)}"

    def _p_values(self, test: RateChange | NewType) -> str:
        return (
            f"p {_p(test.p)}, for all {self.tests} tests {_p(test.adjusted)}, level {self.level:g}"
        )

    def report_lines(self) -> Iterator[str]:
        """Yield the lines of the summary, then the pairs that differ."""
        yield from self.summary_lines()
        for result in DIFFERENT_RESULTS:
            pairs = self.with_result(result)
            for pair in pairs[:PAIRS_LISTED]:
                yield f"{result:<8} {pair.text}"
            if len(pairs) > PAIRS_LISTED:
                yield f"{result:<8} and {len(pairs) - PAIRS_LISTED} more"


def compare(
    pairs: Sequence[Pair],
    *,
    level: float = LEVEL,
    expected_signatures: Collection[str] = (),
    neighbours: NeighbourFlights = MappingProxyType({}),
) -> Comparison:
    """Return how the head compares with the base.

    Violations are tested on all pairs.  Aborts are tested on the pairs without a violation before
    or after: an abort in place of a collision is an improvement, one in place of a landing is not.
    A type is new if no flight of the base and none of the ``expected_signatures`` has it.

    Holm's step-down correction covers all tests: both rates and each type that is new, or rare in
    the base.  It makes ``level`` that of the gate and not of each test (Holm 1979, Scandinavian
    Journal of Statistics 6(2)).
    """
    decided = tuple(pair for pair in pairs if pair.base.decided and pair.head.decided)
    base_types = Counter(pair.base.type for pair in decided if pair.base.violated)
    safe = [pair for pair in decided if not (pair.base.violated or pair.head.violated)]
    violations = _rate_change("violations", "violated", decided, tested=decided)
    aborts = _rate_change("aborts", "aborted", decided, tested=safe)
    new_types = _new_types(decided, expected_signatures, neighbours)
    # A rare type of the base might have looked new as well, so it counts as a test that passed.
    rare = sum(count <= RARE_FLIGHTS for count in base_types.values())
    p_values = [violations.p, aborts.p, *(each.p for each in new_types), *[1.0] * rare]
    adjusted = holm_adjusted(p_values)
    return Comparison(
        pairs=decided,
        undecided=tuple(pair for pair in pairs if pair.base.decided and not pair.head.decided),
        left_out=sum(not pair.base.decided for pair in pairs),
        violations=dataclasses.replace(violations, adjusted=adjusted[0]),
        aborts=dataclasses.replace(aborts, adjusted=adjusted[1]),
        new_types=tuple(
            dataclasses.replace(each, adjusted=p)
            for each, p in zip(new_types, adjusted[2:], strict=False)
        ),
        new_signatures=_new_signatures(decided, expected_signatures, base_types),
        unsure=tuple(
            name for name, flown in neighbours.items() if not all(each.decided for each in flown)
        ),
        tests=len(p_values),
        level=level,
    )


def _rate_change(
    what: str, event: str, decided: Sequence[Pair], *, tested: Sequence[Pair]
) -> RateChange:
    """Count an event, a property of :class:`FlightSummary`, and test it; not yet corrected."""
    broke = sum(getattr(pair.head, event) and not getattr(pair.base, event) for pair in tested)
    fixed = sum(getattr(pair.base, event) and not getattr(pair.head, event) for pair in tested)
    return RateChange(
        what=what,
        base=sum(getattr(pair.base, event) for pair in decided),
        head=sum(getattr(pair.head, event) for pair in decided),
        broke=broke,
        fixed=fixed,
        p=mcnemar_p(broke, fixed),
    )


def _new_types(
    pairs: Sequence[Pair], expected: Collection[str], neighbours: NeighbourFlights
) -> list[NewType]:
    """Return the types that only the head has; their p-values are not yet corrected."""
    old_types = {pair.base.type for pair in pairs} | {violation_type_of(each) for each in expected}
    changed = sum(not pair.identical for pair in pairs)
    found = []
    for new_type in sorted({pair.head.type for pair in pairs} - old_types - {""}):
        having = tuple(pair for pair in pairs if pair.head.type == new_type)
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


def _new_signatures(
    pairs: Sequence[Pair], expected: Collection[str], base_types: Collection[str]
) -> tuple[tuple[str, tuple[Pair, ...]], ...]:
    """Return the signatures that only the head has, of types that are not new, with their pairs."""
    old = {pair.base.signature for pair in pairs} | {*expected}
    types = {*base_types, *(violation_type_of(each) for each in expected)}
    found = sorted({pair.head.signature for pair in pairs if pair.head.type in types} - old)
    return tuple(
        (each, tuple(pair for pair in pairs if pair.head.signature == each)) for each in found
    )


def _names(pairs: Sequence[Pair]) -> str:
    named = ", ".join(pair.name for pair in pairs[:3])
    return f"{named} and {len(pairs) - 3} more" if len(pairs) > 3 else named


def _p(value: float) -> str:
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1e}"
