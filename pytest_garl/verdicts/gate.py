"""The gate: tells whether a changed landing stack is worse on the very same scenarios.

Each scenario is flown by both, so every one of them is a pair.  Pairs that end alike say nothing
about which is better; those that broke stand against those that were mended.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

LEVEL = 0.05
"""How often a stack that is no worse may fail the gate, per system and map."""
SHOWN = 20
"""Pairs that a report in words lists of each kind."""

Fate = Literal["same", "broke", "mended", "changed"]
DIFFERENT: tuple[Fate, ...] = ("broke", "mended", "changed")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What one flight came to, as far as two flights of a scenario are compared.

    ``signature`` is empty for a flight without violation; ``paper_violation`` is the paper's
    narrower definition, which the gate does not use.
    """

    outcome: str
    signature: str
    paper_violation: bool = False
    sha256: str = ""

    @property
    def violated(self) -> bool:
        """Whether a safety property was violated."""
        return bool(self.signature)

    @property
    def aborted(self) -> bool:
        """Whether the landing system gave the landing up."""
        return self.outcome == "aborted"

    @property
    def decided(self) -> bool:
        """Whether the flight says anything at all about the landing system."""
        return self.outcome != "inconclusive"

    @property
    def words(self) -> str:
        """The signature, or how a flight without violation ended."""
        return self.signature or self.outcome


def answer_of(result: Mapping[str, Any], sha256: str) -> Answer:
    """Return the answer in a flight's result, as the ledger holds it."""
    verdict = result["verdict"]
    return Answer(
        outcome=result["outcome"],
        signature=verdict["signature"],
        paper_violation=verdict["paper_violation"],
        sha256=sha256,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """One scenario, called ``name``, flown by the stack as it was (base) and as it is (head)."""

    name: str
    base: Answer
    head: Answer

    @property
    def fate(self) -> Fate:
        """What became of the scenario, violations before aborts."""
        before, after = (_badness(each) for each in (self.base, self.head))
        if before != after:
            return "broke" if after > before else "mended"
        return "same" if self.base.signature == self.head.signature else "changed"

    @property
    def words(self) -> str:
        """How it ended before and after."""
        return f"{self.name}: {self.base.words} -> {self.head.words}"


def _badness(answer: Answer) -> int:
    return 2 if answer.violated else int(answer.aborted)


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A rate before and after: how many of the pairs, how many came and how many went.

    ``p`` is that of :func:`worse`, ``adjusted`` the same after Holm's correction.
    """

    what: str
    base: int
    head: int
    broke: int
    mended: int
    p: float
    adjusted: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two stacks on the same scenarios; ``inconclusive`` pairs are in none of the figures."""

    pairs: tuple[Pair, ...]
    inconclusive: int
    violations: Change
    aborts: Change
    new_signatures: tuple[str, ...]
    level: float

    @property
    def passed(self) -> bool:
        """Whether nothing new went wrong and neither rate is significantly worse."""
        return bool(self.pairs) and not self.new_signatures and not self._worse

    @property
    def _worse(self) -> tuple[Change, ...]:
        changes = (self.violations, self.aborts)
        return tuple(change for change in changes if change.adjusted <= self.level)

    def of(self, fate: Fate) -> tuple[Pair, ...]:
        """Return the pairs of one fate."""
        return tuple(pair for pair in self.pairs if pair.fate == fate)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the gate fails; empty where it passes."""
        found = [
            f"significantly more {change.what}: p {_p(change.adjusted)} at level {self.level:g}"
            for change in self._worse
        ]
        found += [f"new signature: {each}" for each in self.new_signatures]
        return tuple(found) if self.pairs else ("no pair could be compared",)

    def summary(self) -> Iterator[str]:
        """Yield the answer, and lines about both rates."""
        yield "gate passed" if self.passed else f"gate FAILED: {'; '.join(self.reasons)}"
        alike = sum(bool(p.base.sha256) and p.base.sha256 == p.head.sha256 for p in self.pairs)
        yield (
            f"{len(self.pairs)} pairs flown, {alike} of them the same flight to the byte, "
            f"{self.inconclusive} inconclusive and left out"
        )
        for change in (self.violations, self.aborts):
            yield (
                f"{change.what} {change.base} -> {change.head} ({change.broke} more, "
                f"{change.mended} fewer): p {_p(change.p)}, for both tests {_p(change.adjusted)}, "
                f"level {self.level:g}"
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
    pairs: Sequence[Pair], *, level: float = LEVEL, known: Collection[str] = ()
) -> Comparison:
    """Return how the head compares with the base.

    Holm's step-down correction over the two tests, violations and aborts, makes ``level`` that
    of the gate and not of each test (Holm 1979, Scandinavian Journal of Statistics 6(2)).  A
    signature is new if no base flight has it and it is not among the ``known`` ones.
    """
    decided = tuple(pair for pair in pairs if pair.base.decided and pair.head.decided)
    counts = (
        _counts("violations", [(pair.base.violated, pair.head.violated) for pair in decided]),
        _counts("aborts", [(pair.base.aborted, pair.head.aborted) for pair in decided]),
    )
    values = [worse(broke, mended) for _, _, _, broke, mended in counts]
    violations, aborts = (
        Change(what=what, base=base, head=head, broke=broke, mended=mended, p=p, adjusted=q)
        for (what, base, head, broke, mended), p, q in zip(
            counts, values, holm(values), strict=True
        )
    )
    before = {pair.base.signature for pair in decided} | {*known, ""}
    return Comparison(
        pairs=decided,
        inconclusive=len(pairs) - len(decided),
        violations=violations,
        aborts=aborts,
        new_signatures=tuple(sorted({pair.head.signature for pair in decided} - before)),
        level=level,
    )


def worse(broke: int, mended: int) -> float:
    """Return the one-sided p-value of McNemar's exact test that more broke than was mended.

    Had nothing changed, each discordant pair would be as likely to have broken as to have been
    mended (McNemar 1947, Psychometrika 12(2), 153-157), so that of n = ``broke`` + ``mended`` the
    broken ones are binomial with probability 1/2.  The p-value is P(X >= broke).  It is that
    distribution itself and not McNemar's chi-squared approximation of it, because a good stack
    leaves a handful of discordant pairs; and it is one-sided because a gate asks whether the stack
    got worse: one that got better must never fail it.  Without discordant pairs it is 1.
    """
    n = broke + mended
    ways: int = 2**n
    return sum(math.comb(n, k) for k in range(broke, n + 1)) / ways


def holm(values: Sequence[float]) -> tuple[float, ...]:
    """Return p-values adjusted by Holm's step-down method, in the order given."""
    adjusted, running = [0.0] * len(values), 0.0
    for rank, index in enumerate(sorted(range(len(values)), key=values.__getitem__)):
        running = max(running, min(1.0, (len(values) - rank) * values[index]))
        adjusted[index] = running
    return tuple(adjusted)


def _counts(what: str, pairs: Sequence[tuple[bool, bool]]) -> tuple[str, int, int, int, int]:
    return (
        what,
        sum(before for before, _ in pairs),
        sum(after for _, after in pairs),
        sum(after and not before for before, after in pairs),
        sum(before and not after for before, after in pairs),
    )


def _p(value: float) -> str:
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1e}"
