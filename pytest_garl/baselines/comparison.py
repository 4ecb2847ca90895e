"""The gate: tells whether a changed landing stack is worse on the very same scenarios.

Each scenario is flown by both, so every one of them is a pair.  Pairs that end alike say nothing
about which is better; those that broke stand against those that were fixed.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pytest_garl.baselines.gate_statistics import CONFIRMED, holm, looks_new, worse
from pytest_garl.baselines.pairs import DIFFERENT, Answer, Fate, Pair, type_of

LEVEL = 0.05
"""How often a stack that is no worse may fail the gate, per system and map."""
LEFT_OUT = 0.05
"""This share of the baseline may be inconclusive, or one flight of it."""
RARE = 5
"""A type in more flights of the base than this would hardly be missed by chance: one that is
expected in six flights occurs in none of them once in four hundred times."""
SHOWN = 20
"""Pairs that a report in words lists of each kind."""
ENOUGH_PAIRS = 2
"""So many pairs of a new type fail the gate ..."""
ENOUGH_NEIGHBOURS = 2
"""... or one of them of whose neighbours so many fail alike, if it cannot be chance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A rate before and after: how many of the pairs, how many came and how many went.

    ``p`` is that of :func:`worse`, ``adjusted`` the same after Holm's correction.
    """

    what: str
    base: int
    head: int
    broke: int
    fixed: int
    p: float
    adjusted: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NewType:
    """A type of violation that no flight of the base has, in ``pairs`` of the head.

    ``alike`` holds, for each pair whose neighbours were flown, how many of how many fail in this
    type; ``p`` is that of :func:`looks_new`, ``adjusted`` the same after Holm's correction.
    """

    type: str
    pairs: tuple[Pair, ...]
    alike: tuple[tuple[int, int], ...]
    p: float
    adjusted: float

    @property
    def shown(self) -> bool:
        """Whether it shows in two pairs, or in one beside which others fail in the same way."""
        beside = any(alike >= ENOUGH_NEIGHBOURS for alike, _ in self.alike)
        return beside or len(self.pairs) >= ENOUGH_PAIRS

    @property
    def words(self) -> str:
        """In which pairs it shows, and in how many of their neighbours."""
        first, more = self.pairs[0], len(self.pairs) - 1
        flown = sum(count for _, count in self.alike)
        beside = f", in {sum(alike for alike, _ in self.alike)} of {flown} neighbours"
        return (
            f"{self.type} in {first.name}{f' and {more} more' if more else ''}"
            f"{beside if flown else ''}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two stacks on the same scenarios.

    ``pairs`` are those that both decided.  ``undecided`` are those that the base alone decided, and
    ``left_out`` counts those that the base did not decide: neither is in any of the figures.
    ``new_kinds`` are signatures that the base lacks, of types that it has, with their pairs.
    ``tests`` is how many p-values were corrected together.
    """

    pairs: tuple[Pair, ...]
    undecided: tuple[Pair, ...]
    left_out: int
    violations: Change
    aborts: Change
    new_types: tuple[NewType, ...]
    new_kinds: tuple[tuple[str, tuple[Pair, ...]], ...]
    unsure: tuple[str, ...]
    """Pairs of new types a neighbour of which was inconclusive."""
    tests: int
    level: float

    @property
    def passed(self) -> bool:
        """Whether all was decided, nothing of a new type went wrong and neither rate is worse."""
        return not self.reasons

    def of(self, fate: Fate) -> tuple[Pair, ...]:
        """Return the pairs of one fate."""
        return tuple(pair for pair in self.pairs if pair.fate == fate)

    @property
    def to_confirm(self) -> tuple[Pair, ...]:
        """Pairs whose neighbours tell whether a new type is real."""
        return tuple(pair for each in self.new_types for pair in each.pairs[:CONFIRMED])

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the gate fails; empty where it passes."""
        found = [
            f"significantly more {change.what}: p {_p(change.adjusted)} at level {self.level:g}"
            for change in (self.violations, self.aborts)
            if change.adjusted <= self.level
        ]
        found += [
            f"new type of violation: {each.words}" for each in self.new_types if self._fails(each)
        ]
        flown = len(self.pairs) + len(self.undecided) + self.left_out
        if self.left_out > max(1, LEFT_OUT * flown):
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
        return new.shown and new.adjusted <= self.level

    def summary(self) -> Iterator[str]:
        """Yield the answer, and lines about the rates and what is new."""
        yield "gate passed" if self.passed else f"gate FAILED: {'; '.join(self.reasons)}"
        alike = sum(pair.repeated for pair in self.pairs)
        yield f"{len(self.pairs)} pairs compared, {alike} of them the same flight to the byte"
        if self.left_out:
            yield f"{self.left_out} left out: inconclusive when the baseline was saved"
        for change, came, went in (
            (self.violations, "broke", "fixed"),
            (self.aborts, "landings lost", "landings won"),
        ):
            yield (
                f"{change.what} {change.base} -> {change.head} ({change.broke} {came}, "
                f"{change.fixed} {went}): {self._values(change)}"
            )
        for new in self.new_types:
            doubt = "" if self._fails(new) else ": may be chance, look at it"
            yield f"new type of violation: {new.words}: {self._values(new)}{doubt}"
        for signature, pairs in self.new_kinds:
            yield f"new kind of a known type, not gated: {signature} in {_names(pairs)}"

    def _values(self, test: Change | NewType) -> str:
        return (
            f"p {_p(test.p)}, for all {self.tests} tests {_p(test.adjusted)}, level {self.level:g}"
        )

    def sentences(self) -> Iterator[str]:
        """Yield all that there is to tell, line by line: the answer, figures, pairs."""
        yield from self.summary()
        for fate in DIFFERENT:
            pairs = self.of(fate)
            for pair in pairs[:SHOWN]:
                yield f"{fate:<8} {pair.words}"
            if len(pairs) > SHOWN:
                yield f"{fate:<8} and {len(pairs) - SHOWN} more"


def compare(
    pairs: Sequence[Pair],
    *,
    level: float = LEVEL,
    known: Collection[str] = (),
    neighbours: Mapping[str, Sequence[Answer]] = MappingProxyType({}),
) -> Comparison:
    """Return how the head compares with the base.

    Violations are tested on all pairs, aborts on those without a violation before or after: giving
    up in place of a collision is a repair, giving up in place of a landing is none.  A type is new
    if no base flight has it and it is none of the ``known`` signatures' types.  ``neighbours``
    holds what the head made of scenarios beside a pair's, by the pair's name.

    Holm's step-down correction over all tests, of both rates and of each type that is new, or rare
    in the base, makes ``level`` that of the gate and not of each test (Holm 1979, Scandinavian
    Journal of Statistics 6(2)).
    """
    decided = tuple(pair for pair in pairs if pair.base.decided and pair.head.decided)
    safe = [pair for pair in decided if not (pair.base.violated or pair.head.violated)]
    violated = [(pair.base.violated, pair.head.violated) for pair in decided]
    aborted = [(pair.base.aborted, pair.head.aborted) for pair in safe]
    new = _new_types(decided, {type_of(each) for each in known}, neighbours)
    old = Counter(pair.base.type for pair in decided if pair.base.violated)
    # A rare type could have looked new as well: it is a test, one that happened not to fail.
    rare = sum(count <= RARE for count in old.values())
    values = [_rate(violated), _rate(aborted), *(each.p for each in new), *[1.0] * rare]
    corrected = holm(values)
    violations, aborts = (
        Change(
            what=what,
            base=sum(getattr(pair.base, field) for pair in decided),
            head=sum(getattr(pair.head, field) for pair in decided),
            broke=_came(counted),
            fixed=_went(counted),
            p=p,
            adjusted=q,
        )
        for what, field, counted, p, q in zip(
            ("violations", "aborts"),
            ("violated", "aborted"),
            (violated, aborted),
            values,
            corrected,
            strict=False,
        )
    )
    return Comparison(
        pairs=decided,
        undecided=tuple(pair for pair in pairs if pair.base.decided and not pair.head.decided),
        left_out=sum(not pair.base.decided for pair in pairs),
        violations=violations,
        aborts=aborts,
        new_types=tuple(
            dataclasses.replace(each, adjusted=q)
            for each, q in zip(new, corrected[2:], strict=False)
        ),
        new_kinds=_new_kinds(decided, {*known}, set(old)),
        unsure=tuple(
            name for name, flown in neighbours.items() if not all(each.decided for each in flown)
        ),
        tests=len(values),
        level=level,
    )


def _new_types(
    pairs: Sequence[Pair], known: Collection[str], neighbours: Mapping[str, Sequence[Answer]]
) -> list[NewType]:
    """Return the types that the head has and the base has not, not yet corrected."""
    before = {pair.base.type for pair in pairs} | {*known, ""}
    drawn = sum(not pair.repeated for pair in pairs)
    found = []
    for kind in sorted({pair.head.type for pair in pairs} - before):
        having = tuple(pair for pair in pairs if pair.head.type == kind)
        alike = tuple(
            (sum(each.type == kind for each in flown), len(flown))
            for pair in having
            if (flown := neighbours.get(pair.name))
        )
        p = looks_new(
            base=len(pairs),
            drawn=drawn,
            found=len(having),
            beside=max((count for _, count in alike), default=0),
            alike=sum(count for count, _ in alike),
        )
        found.append(NewType(type=kind, pairs=having, alike=alike, p=p, adjusted=1.0))
    return found


def _new_kinds(
    pairs: Sequence[Pair], known: Collection[str], types: Collection[str]
) -> tuple[tuple[str, tuple[Pair, ...]], ...]:
    """Return the signatures that are new though their type is not, with their pairs."""
    before = {pair.base.signature for pair in pairs} | {*known}
    types = {*types, *(type_of(each) for each in known)}
    found = sorted({pair.head.signature for pair in pairs if pair.head.type in types} - before)
    return tuple(
        (each, tuple(pair for pair in pairs if pair.head.signature == each)) for each in found
    )


def _rate(counted: Sequence[tuple[bool, bool]]) -> float:
    return worse(_came(counted), _went(counted))


def _came(counted: Sequence[tuple[bool, bool]]) -> int:
    return sum(after and not before for before, after in counted)


def _went(counted: Sequence[tuple[bool, bool]]) -> int:
    return sum(before and not after for before, after in counted)


def _names(pairs: Sequence[Pair]) -> str:
    named = ", ".join(pair.name for pair in pairs[:3])
    return f"{named} and {len(pairs) - 3} more" if len(pairs) > 3 else named


def _p(value: float) -> str:
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1e}"
