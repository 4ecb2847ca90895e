"""Two flights of one scenario, one of each landing system, and the difference between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pytest_garl.execution.result import FlightResult

NoLanding = Literal["", "blocked", "excused", "needless"]
PairResult = Literal["same", "broke", "fixed", "changed"]
"""``broke`` and ``fixed``: the second flight ended worse or better; ``changed``: both violate, in
different ways."""
DIFFERENT_RESULTS: tuple[PairResult, ...] = ("broke", "fixed", "changed")
Column = Literal["landed", "violations", "blocked", "excused", "needless"]
COLUMNS: tuple[Column, ...] = ("landed", "violations", "blocked", "excused", "needless")
NOT_LANDED = ("gave_up", "not_landed")
"""Outcomes of flights of which a reason says why they did not land."""
DISTANCE_DIGITS, TIME_DIGITS = 4, 3
"""A tenth of a millimetre and a millisecond, far below what a landing repeats."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightSummary:
    """The part of a flight's result that the gate compares.

    ``signature`` is empty for a flight without violation.  ``paper_violation`` is the paper's
    definition, which the gate does not use.  ``no_landing`` says why a flight that was given up or
    ran out of time is excused, or that it is not.  ``distance_m`` and ``time_s`` are those of the
    landing, None without one.  ``sha256`` is the trajectory's hash.
    """

    outcome: str
    signature: str
    paper_violation: bool = False
    no_landing: NoLanding = ""
    distance_m: float | None = None
    time_s: float | None = None
    sha256: str = ""

    @property
    def violated(self) -> bool:
        """Whether the flight violated a safety property."""
        return bool(self.signature)

    @property
    def landed(self) -> bool:
        """Whether the flight landed, or held its place, and violated no property."""
        return self.outcome in ("landed", "held") and not self.violated

    @property
    def not_landed(self) -> bool:
        """Whether the landing system gave up or ran out of time."""
        return self.outcome in NOT_LANDED

    @property
    def decided(self) -> bool:
        """Whether the flight is evidence about the landing system at all."""
        return self.outcome != "inconclusive"

    @property
    def type(self) -> str:
        """The violation type, such as IV; empty for a flight without violation."""
        return violation_type_of(self.signature)

    @property
    def badness(self) -> int:
        """How bad the end was: a violation 3, a needless or forbidden giving up 2, an excused 1."""
        if self.violated and not self.not_landed:
            return 3
        if self.violated or self.no_landing == "needless":
            return 2
        return int(self.not_landed)

    @property
    def is_grave(self) -> bool:
        """Whether the flight violated a property in another way than by not landing."""
        return self.badness == 3

    @property
    def is_safe_abort(self) -> bool:
        """Whether the flight ended without a landing, and without a violation."""
        return self.not_landed and not self.violated

    def is_in(self, column: Column) -> bool:
        """Return whether a column of a table counts the flight; violations may be needless too."""
        if column == "landed":
            return self.landed
        if column == "violations":
            return self.violated
        return self.no_landing == column

    @property
    def text(self) -> str:
        """The signature, or the outcome of a flight without violation."""
        if self.signature or not self.not_landed:
            return self.signature or self.outcome
        return f"{self.outcome.replace('_', ' ')} ({self.no_landing})"


def violation_type_of(signature: str) -> str:
    """Return the type at the beginning of a signature: IV of "IV:dog:descent:seen"."""
    return signature.partition(":")[0].rstrip("?")


def summary_of(result: FlightResult, sha256: str) -> FlightSummary:
    """Return the summary of a flight's result and the hash of its trajectory.

    The time is the touchdown's; a simulator that records no touchdown gives that of its end.
    """
    landed = result.outcome == "landed"
    time_s = result.elapsed_s if result.landed_s is None else result.landed_s
    return FlightSummary(
        outcome=result.outcome,
        signature=result.signature,
        paper_violation=result.verdict.paper_violation,
        no_landing=result.verdict.no_landing,
        distance_m=round(result.final_distance_m, DISTANCE_DIGITS) if landed else None,
        time_s=round(time_s, TIME_DIGITS) if landed else None,
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
        """How the flight of the head differs; a violation is worse than giving up needlessly."""
        before, after = self.base.badness, self.head.badness
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


def column_counts(flights: Sequence[FlightSummary]) -> dict[Column, int]:
    """Return how many of the decided flights each column counts."""
    decided = [each for each in flights if each.decided]
    return {name: sum(each.is_in(name) for each in decided) for name in COLUMNS}
