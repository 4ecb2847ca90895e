"""Two flights of one scenario: what each came to, and what became of the scenario."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pytest_garl.execution.result import FlightResult

Fate = Literal["same", "broke", "fixed", "changed"]
DIFFERENT: tuple[Fate, ...] = ("broke", "fixed", "changed")


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
    def type(self) -> str:
        """The violation's type, such as IV; empty for a flight without violation."""
        return type_of(self.signature)

    @property
    def words(self) -> str:
        """The signature, or how a flight without violation ended."""
        return self.signature or self.outcome


def type_of(signature: str) -> str:
    """Return the type that a signature begins with: IV of "IV:dog:descent:seen"."""
    return signature.partition(":")[0].rstrip("?")


def answer_of(result: FlightResult, sha256: str) -> Answer:
    """Return the answer in a flight's result, as the ledger holds it."""
    return Answer(
        outcome=result.outcome,
        signature=result.signature,
        paper_violation=result.verdict.paper_violation,
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
            return "broke" if after > before else "fixed"
        return "same" if self.base.signature == self.head.signature else "changed"

    @property
    def repeated(self) -> bool:
        """Whether both flights are the same to the byte."""
        return bool(self.base.sha256) and self.base.sha256 == self.head.sha256

    @property
    def words(self) -> str:
        """How it ended before and after."""
        return f"{self.name}: {self.base.words} -> {self.head.words}"


def _badness(answer: Answer) -> int:
    return 2 if answer.violated else int(answer.aborted)
