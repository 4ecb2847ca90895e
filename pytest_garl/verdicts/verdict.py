"""The verdict on one flight: limits, margins, primary property, violation type, signature."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from pytest_garl.errors import OptionError, of_a_user
from pytest_garl.fiducial import MARKER_SIDE_M
from pytest_garl.messages import shown
from pytest_garl.verdicts.ending import ending_of

__tracebackhide__ = of_a_user
LONGEST_S = 300.0
"""The largest limit of time, in seconds: more than twice the paper's two minutes, and short enough
that a landing system that hovers does not hold up a search."""
FARTHEST_M = 1000.0
"""The largest limit of distance, wider than any map."""
LEAST_DISTANCE_M = 0.3
"""The smallest default limit of distance: what a landing by a camera reaches."""


def default_distance_m(marker_side_m: float) -> float:
    """Return the limit of distance for a marker: the UAV stands on it."""
    return max(LEAST_DISTANCE_M, marker_side_m / 2)


PropertyName = Literal["distance", "time", "collision", "crash", "abort", "own"]
"""The property that a violation is about.  A flight that gives up needlessly violates "time": it
never lands.  Where the limits forbid to give up, the property is "abort", which no test asserts."""
ViolationType = Literal["I", "II", "III", "IV", "V", "late", "off", "hard", "slid", "abort", "own"]
"""The paper's five types, and further ones; "own" is a property that a user's test asserts."""
MarginName = Literal[
    "distance",
    "time",
    "collision",
    "moving",
    "static",
    "touchdown_speed",
    "touchdown_tilt",
    "dropout",
    "decoy",
    "tracking",
    "slide",
    "crash",
    "abort",
    "own",
]
Excuse = Literal["", "undetectable", "blocked"]
"""Why nobody could have landed: the marker could not be read for long enough, or people, dogs or
birds never left it free for long enough.  Empty if somebody could."""
NoLanding = Literal["", "blocked", "excused", "needless"]
"""Why a flight that was given up or ran out of time is excused, or that it is needless; empty for
any other flight."""
NO_LANDING = ("gave_up", "not_landed")
"""Outcomes of flights that never came down."""
_NO_LANDING: Mapping[Excuse, NoLanding] = {
    "blocked": "blocked",
    "undetectable": "excused",
    "": "needless",
}
AbortRule = Literal["needless", "ok", "violation"]


def _plain(value: object) -> float | None:
    """Return a number whose comparisons are Python's own; None for what is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return value if type(value) in (int, float) else float(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits beyond which a flight violates a property.

    ``distance_m`` is half the marker's side, and at least 0.3 m: the UAV stands on the marker.
    ``time_s`` is 120, the Wingcopter's two minutes in multi-copter mode (paper).  ``abort`` says
    when a landing that is given up is a violation: "needless" unless nobody could have landed,
    "violation" always, "ok" never.  Raises OptionError for a limit out of range, or another rule.
    """

    distance_m: float = default_distance_m(MARKER_SIDE_M)
    time_s: float = 120.0
    abort: AbortRule = "needless"

    def __post_init__(self) -> None:
        for name, high in (("distance_m", FARTHEST_M), ("time_s", LONGEST_S)):
            given = getattr(self, name)
            value = _plain(given)
            if value is None or not 0 <= value <= high:
                raise OptionError(
                    f"limits: found {name}={shown(given)}, expected a number from 0 to {high:g}"
                )
            object.__setattr__(self, name, value)
        if self.abort not in get_args(AbortRule):
            raise OptionError(
                f"limits: found abort={shown(self.abort)}, expected 'needless', 'ok' or 'violation'"
            )


class LimitsOfMarker(Limits):
    """Limits that state no distance: it follows from the size of the marker that lies there."""

    __slots__ = ()


def limits(**given: Any) -> Limits:
    """Return the limits of a mark ``garl``; raise OptionError for an unknown name."""
    known = [field.name for field in dataclasses.fields(Limits)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise OptionError(
            f"limits: found {', '.join(unknown)}, expected {', '.join(known[:-1])} or {known[-1]}, "
            "such as limits(distance_m=1.0)"
        )
    return Limits(**given) if "distance_m" in given else LimitsOfMarker(**given)


DEFAULT_LIMITS = Limits()
PAPER_LIMITS = Limits(distance_m=1.5, abort="violation")
"""The limits of the paper's definition of a violation: certainly outside of the 1.5 m marker, and
more than the GPS error (paper, RQ1); each landing that is given up counts, since "no landing
occurs"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """Distance of a property from its violation: signed, negative if the property is violated.

    ``value`` is in ``unit``.  ``decided`` is False if the flight ended before the property was
    decided, so that the value is an estimate; ``reason`` then says why.
    """

    property: MarginName
    value: float
    unit: str
    decided: bool = True
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Something that had gone wrong before the event that decided the flight.

    ``signature`` names it like that of a violation, such as ``off:descending-elsewhere``;
    ``margin`` is negative, in ``unit``; ``story`` is a sentence.
    """

    signature: str
    margin: float
    unit: str
    time_s: float
    story: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The judgement of one flight.

    ``primary`` is the property that the flight violates first, and ``None`` if it violates none.
    ``signature`` names the mechanism and the phase of the landing, such as
    ``IV:dog:last-metre:unseen``, and the condition that acted if it was one alone, such as
    ``II:lost:descent:fog``.  ``paper_violation`` is the paper's definition: a collision, a
    landing more than 1.5 m from the marker, or no landing.  ``story`` says in sentences what
    happened, where and when.  ``completed`` says whether the mission was: landed within the limit
    of distance.  ``excuse`` says why nobody could have landed in a flight without landing, and
    ``excuse_text`` says it in a sentence.  ``findings`` are what had gone wrong before.
    """

    outcome: str
    primary: PropertyName | None
    violation_type: ViolationType | None
    signature: str
    paper_violation: bool
    margins: tuple[Margin, ...]
    story: str
    completed: bool = False
    excuse: Excuse = ""
    excuse_text: str = ""
    findings: tuple[Finding, ...] = ()

    @property
    def violation(self) -> bool:
        """Whether the flight violated a safety property."""
        return self.primary is not None

    @property
    def ending(self) -> str:
        """The signature without the condition that acted: what flights are compared by."""
        return ending_of(self.signature)

    @property
    def cause(self) -> str:
        """Type and cause without phase and sight, such as ``IV:dog``; empty without a violation."""
        return cause_of(self.signature)

    @property
    def no_landing(self) -> NoLanding:
        """Why a flight that was given up or ran out of time is excused, or that it is not."""
        if self.outcome not in NO_LANDING:
            return ""
        return _NO_LANDING[self.excuse]

    def margin(self, name: MarginName) -> Margin | None:
        """Return the margin of a property, None if the flight has none."""
        return next((margin for margin in self.margins if margin.property == name), None)


def cause_of(signature: str) -> str:
    """Return the type and the cause in a signature, without phase and sight."""
    return ":".join(signature.split(":")[:2])


def count_decided(verdicts: Sequence[Verdict], name: PropertyName) -> int:
    """Return the number of flights that decided a property: it held, or it was violated."""
    return sum(
        margin.decided
        for verdict in verdicts
        for margin in verdict.margins
        if margin.property == name
    )
