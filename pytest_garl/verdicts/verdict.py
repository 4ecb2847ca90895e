"""The verdict on one flight: limits, margins, primary property, violation type, signature."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from pytest_garl.errors import OptionError
from pytest_garl.messages import shown

LONGEST_S = 300.0
"""The largest limit of time, in seconds: more than twice the paper's two minutes, and short enough
that a landing system that hovers does not hold up a search."""
FARTHEST_M = 1000.0
"""The largest limit of distance, wider than any map."""
PropertyName = Literal["distance", "time", "collision", "crash", "abort", "own"]
ViolationType = Literal["I", "II", "III", "IV", "V", "late", "off", "hard", "abort", "own"]
"""The paper's five types, and further ones; "own" is a property that a user's test asserts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits beyond which a flight violates a property; the defaults are the paper's.

    ``distance_m`` is 1.5: certainly outside of the 1.5 m marker, and more than the GPS error
    (paper, RQ1).  ``time_s`` is 120, the Wingcopter's two minutes in multi-copter mode.  ``abort``
    is "ok" if aborted landings are reported as a share of their own, "violation" if they count as
    violations.
    """

    distance_m: float = 1.5
    time_s: float = 120.0
    abort: Literal["ok", "violation"] = "ok"

    def __post_init__(self) -> None:
        for name, high in (("distance_m", FARTHEST_M), ("time_s", LONGEST_S)):
            value = getattr(self, name)
            good = isinstance(value, int | float) and not isinstance(value, bool)
            if not good or not 0 <= value <= high:
                raise OptionError(
                    f"limits: found {name}={shown(value)}, expected a number from 0 to {high:g}"
                )
        if self.abort not in ("ok", "violation"):
            raise OptionError(
                f"limits: found abort={shown(self.abort)}, expected 'ok' or 'violation'"
            )


def limits(**given: Any) -> Limits:
    """Return the limits of a marker; raise OptionError for an unknown name."""
    known = [field.name for field in dataclasses.fields(Limits)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise OptionError(
            f"limits: found {', '.join(unknown)}, expected {', '.join(known[:-1])} or {known[-1]}, "
            "such as limits(distance_m=1.0)"
        )
    return Limits(**given)


PAPER_LIMITS = Limits()
"""The limits of the paper's definition of a violation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """Distance of a property from its violation: signed, negative if the property is violated.

    ``value`` is in ``unit``.  ``decided`` is False if the flight ended before the property was
    decided; ``reason`` then says why.
    """

    property: PropertyName
    value: float
    unit: str
    decided: bool = True
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The judgement of one flight.

    ``primary`` is the property that the flight violates first, and ``None`` if it violates none.
    ``signature`` names the mechanism and the phase of the landing, such as
    ``IV:dog:last-metre:unseen``.  ``paper_violation`` is the paper's narrower definition
    (collision, or not landed within 1.5 m of the marker).  ``story`` says in sentences what
    happened, where and when.
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


def count_decided(verdicts: Sequence[Verdict], name: PropertyName) -> int:
    """Return the number of flights that decided a property: it held, or it was violated."""
    return sum(
        margin.decided
        for verdict in verdicts
        for margin in verdict.margins
        if margin.property == name
    )
