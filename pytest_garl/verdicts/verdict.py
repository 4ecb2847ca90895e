"""What a flight means: limits, margins, the primary property, the type and the signature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PropertyName = Literal["distance", "time", "collision", "crash", "abort", "own"]
ViolationType = Literal["I", "II", "III", "IV", "V", "late", "off", "hard", "abort", "own"]
"""The paper's five types and ours; "own" is what a test asserts beyond them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What counts as a violation; the paper's figures by default.

    ``distance_m`` 1.5: outside the 1.5 m marker for sure, and more than the GPS error
    (paper, RQ1).  ``time_s`` 120: the Wingcopter's two minutes in multi-copter mode.
    ``abort``: "ok" shows aborted landings as their own share, "violation" counts them.
    """

    distance_m: float = 1.5
    time_s: float = 120.0
    abort: Literal["ok", "violation"] = "ok"


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """How far a property is from being violated: signed, negative when violated.

    ``value`` is in ``unit``; ``decided`` is False where the flight ended before the
    property could be told, and ``reason`` then says why.
    """

    property: PropertyName
    value: float
    unit: str
    decided: bool = True
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The judgement of one flight.

    ``primary`` is the one property that a violating flight violates first, ``None`` for a
    flight without violation.  ``signature`` names the mechanism and the moment, such as
    ``IV:dog:last-metre:unseen``.  ``paper_violation`` is the paper's narrower definition
    (collision, or not landed within 1.5 m of the marker).  ``story`` says in sentences
    what happened, where and when.
    """

    outcome: str
    primary: PropertyName | None
    violation_type: ViolationType | None
    signature: str
    paper_violation: bool
    margins: tuple[Margin, ...]
    story: str

    @property
    def violation(self) -> bool:
        """Whether the flight violated a safety property."""
        return self.primary is not None
