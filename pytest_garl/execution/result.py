"""Results of flights and origins of scenarios: the ledger stores them, other rooms read them."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from typing import Any, Literal, Self

from pytest_garl.errors import LedgerError
from pytest_garl.execution.database import REMEDY
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.flight.flight import Crash
from pytest_garl.messages import visible
from pytest_garl.verdicts.verdict import PAPER_LIMITS, Verdict

How = Literal["control", "stratified", "bred", "replayed", "use", "inside", "outside"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """How the scenario of a slot was made: by chance, without parents, or from flights.

    A replayed one failed in an earlier search, of other code, another system or another domain.
    ``parents`` are the slots of the flights whose conditions and NPCs a child has, such as
    ``court-g00-s03``, or ``archived-17`` for one of an earlier search.  ``expected`` is what the
    model of the landing system predicted: the proximity of each property, from 1 on a violation;
    ``fails`` the probability of a violation, None without a model.

    One of a model of use is a plain draw ("use"), or a draw inside or outside of the region in
    which a failure is predicted; ``share`` is the share of landings in use for which such draws
    stand, None for all others.
    """

    how: How
    parents: tuple[str, ...] = ()
    expected: dict[str, float] = field(default_factory=dict)
    fails: float | None = None
    share: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightResult:
    """How one flight ended and how it was judged.

    ``outcome`` is that of the flight, or "inconclusive" if it came to no end.
    ``final_distance_m`` is horizontal, from the UAV to the marker's centre at the end;
    ``elapsed_s`` is the simulated time since the mission's start.  ``collisions`` are the names
    of the bodies that the UAV hit.  ``undecided`` says why a property
    could not be judged: the message of a crash, or why the flight is inconclusive.
    ``off_marker_m`` is the distance of a touchdown too far from the marker before the UAV gave up.
    ``closest_call`` is the signature that a near miss would have had, ``closest_body`` the body
    of that near miss; both are empty without one.  ``landed_s`` is the time of the touchdown of a
    flight that landed.  ``severity`` is what a violation took; None without a violation.
    ``decided`` are the genes with which the flight repeats without a director that decides in it.
    """

    outcome: str
    final_distance_m: float
    elapsed_s: float
    collisions: tuple[str, ...]
    undecided: str
    closest_call: str
    closest_body: str
    verdict: Verdict
    crash: Crash | None
    off_marker_m: float | None = None
    landed_s: float | None = None
    severity: Severity | None = None
    decided: tuple[tuple[str, float], ...] = ()

    @property
    def signature(self) -> str:
        """How it ended: the violation's signature without its cause; empty without a violation.

        Flights are compared by it.
        """
        return self.verdict.ending

    @property
    def inconclusive(self) -> bool:
        """Whether the flight came to no end, and so decides nothing."""
        return self.outcome == "inconclusive"

    def to_json(self) -> dict[str, Any]:
        """Return plain values, as the ledger holds them."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, values: Any) -> Self:
        """Return the result whose :meth:`to_json` gave ``values``.

        Raises ValueError that names the field, what was found and what was expected.
        """
        return dataclass_from(cls, values)

    def dumps(self) -> str:
        """Return the text that the ledger holds: the same bytes for equal results."""
        return json.dumps(self.to_json(), sort_keys=True, allow_nan=False)


def parse_result(text: str) -> FlightResult:
    """Return the result in a text of the ledger; raise LedgerError for a damaged one.

    Control characters in what a landing system said are written out.
    """
    try:
        values = parse_json(text)
        # JSON escapes all characters beyond ASCII, and control characters too.
        return FlightResult.from_json(_printable(values) if "\\u" in text else values)
    except ValueError as error:
        raise LedgerError(f"a result in the ledger is damaged: {error}. {REMEDY}") from error


def _printable(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _printable(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_printable(item) for item in value]
    return visible(value) if isinstance(value, str) else value


def broken_result(crash: Crash, diagonal_m: float, *, inconclusive: bool = False) -> FlightResult:
    """Return the result of a flight without a record; ``diagonal_m`` is that of its map."""
    verb = "made nonsense" if crash.kind == "nonsense" else crash.kind
    return FlightResult(
        outcome="inconclusive" if inconclusive else "crashed",
        final_distance_m=diagonal_m,
        elapsed_s=PAPER_LIMITS.time_s,
        collisions=(),
        undecided=crash.message,
        closest_call="",
        closest_body="",
        verdict=Verdict(
            outcome="crashed",
            primary=None if inconclusive else "crash",
            violation_type=None if inconclusive else "V",
            signature="" if inconclusive else f"V:{crash.kind}:{crash.error}",
            paper_violation=not inconclusive,
            margins=(),
            story=f"The landing system {verb}: {crash.message}.",
        ),
        crash=crash,
        severity=None if inconclusive else NO_SEVERITY,
    )
