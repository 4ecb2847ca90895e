"""Results of flights for tests that fly nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pytest_garl.execution.result import FlightResult
from pytest_garl.flight.flight import Crash
from pytest_garl.verdicts.verdict import (
    Excuse,
    Finding,
    Margin,
    PropertyName,
    Verdict,
    ViolationType,
)


def flight_result(
    signature: str = "",
    *,
    outcome: str = "",
    primary: PropertyName | None = None,
    violation_type: ViolationType | None = None,
    paper_violation: bool | None = None,
    margins: tuple[Margin, ...] = (),
    story: str = "A story.",
    completed: bool = False,
    excuse: Excuse = "",
    excuse_text: str = "",
    findings: tuple[Finding, ...] = (),
    **fields: Any,
) -> FlightResult:
    """Return the result of a landing, or of a collision if there is a signature."""
    violates = bool(signature)
    outcome = outcome or ("collision" if violates else "landed")
    verdict = Verdict(
        outcome=outcome,
        primary=primary or ("collision" if violates else None),
        violation_type=violation_type or ("IV" if violates else None),
        signature=signature,
        paper_violation=violates if paper_violation is None else paper_violation,
        margins=margins,
        story=story,
        completed=completed,
        excuse=excuse,
        excuse_text=excuse_text,
        findings=findings,
    )
    plain: dict[str, Any] = {
        "outcome": outcome,
        "final_distance_m": 0.1,
        "elapsed_s": 30.0,
        "collisions": (),
        "undecided": "",
        "closest_call": "",
        "closest_body": "",
        "crash": None,
    }
    return FlightResult(**{**plain, **fields}, verdict=verdict)


def crash(kind: Any = "raised", **fields: str) -> Crash:
    """Return how a landing system broke down."""
    return Crash(**{"kind": kind, "error": "E", "message": "", **fields})


def repeated(files: Sequence[str], slot: str) -> str:
    """Return the command that flies a slot again, called where the files are named from."""
    return " ".join(("pytest", *files, f"--garl-repeat={slot}"))
