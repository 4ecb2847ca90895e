"""Two flights of one scenario, one of each landing system, and the difference between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pytest_garl.execution.result import FlightResult

PairResult = Literal["same", "broke", "fixed", "changed"]
"""``broke`` and ``fixed``: the second flight ended worse or better; ``changed``: both violate, in
different ways."""
DIFFERENT_RESULTS: tuple[PairResult, ...] = ("broke", "fixed", "changed")


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSummary:
    """The part of a flight's result that the gate compares.

    ``signature`` is empty for a flight without violation.  ``paper_violation`` is the paper's
    narrower definition, which the gate does not use.  ``sha256`` is the trajectory's hash.
    """

    outcome: str
    signature: str
    paper_violation: bool = False
    sha256: str = ""

    @property
    def violated(self) -> bool:
        """Whether the flight violated a safety property."""
        return bool(self.signature)

    @property
    def aborted(self) -> bool:
        """Whether the landing system aborted the landing."""
        return self.outcome == "gave_up"

    @property
    def decided(self) -> bool:
        """Whether the flight is evidence about the landing system at all."""
        return self.outcome != "inconclusive"

    @property
    def type(self) -> str:
        """The violation type, such as IV; empty for a flight without violation."""
        return violation_type_of(self.signature)

    @property
    def text(self) -> str:
        """The signature, or the outcome of a flight without violation."""
        return self.signature or self.outcome


def violation_type_of(signature: str) -> str:
    """Return the type at the beginning of a signature: IV of "IV:dog:descent:seen"."""
    return signature.partition(":")[0].rstrip("?")


def summary_of(result: FlightResult, sha256: str) -> FlightSummary:
    """Return the summary of a flight's result and the hash of its trajectory."""
    return FlightSummary(
        outcome=result.outcome,
        signature=result.signature,
        paper_violation=result.verdict.paper_violation,
        sha256=sha256,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Two flights of the scenario ``name``: by the saved landing system and by the changed one.

    ``base`` is the saved one's, ``head`` the changed one's, as in a pull request.
    """

    name: str
    base: FlightSummary
    head: FlightSummary

    @property
    def result(self) -> PairResult:
        """How the flight of the head differs; a violation is worse than an abort."""
        before, after = (_badness(each) for each in (self.base, self.head))
        if before != after:
            return "broke" if after > before else "fixed"
        return "same" if self.base.signature == self.head.signature else "changed"

    @property
    def identical(self) -> bool:
        """Whether both flights have the same trajectory, byte for byte."""
        return bool(self.base.sha256) and self.base.sha256 == self.head.sha256

    @property
    def text(self) -> str:
        """The pair in one line, such as ``lawn-2: landed -> IV:dog:descent:seen``."""
        return f"{self.name}: {self.base.text} -> {self.head.text}"


def _badness(flight: FlightSummary) -> int:
    return 2 if flight.violated else int(flight.aborted)
