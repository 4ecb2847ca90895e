"""How bad the worst violation of a kind is: the bound of what its case excuses."""

from __future__ import annotations

from collections.abc import Sequence

from pytest_garl.cases.case import Worst
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.story import GRADES


def worst_of(result: FlightResult) -> Worst:
    """Return the margin of a flight's violated property, and its adversary."""
    verdict, severity = result.verdict, result.severity
    found = next((each for each in verdict.margins if each.property == verdict.primary), None)
    return Worst(margin=found.value if found else 0.0, grade=severity.grade if severity else "")


def worst_in(found: Sequence[Worst]) -> Worst:
    """Return the worst margin and the weakest adversary of several."""
    return Worst(
        margin=min(each.margin for each in found),
        grade=min((each.grade for each in found), key=_rank),
    )


def why_worse(result: FlightResult, worst: Worst | None) -> str:
    """Return in what a violation is worse than the worst one that is known; empty if in nothing."""
    if worst is None:
        return ""
    found = worst_of(result)
    if found.margin < worst.margin:
        return f"its margin is {found.margin:.3g}, the worst known is {worst.margin:.3g}"
    if _rank(found.grade) < _rank(worst.grade):
        known = worst.grade or "unknown"
        return f"its adversary is {found.grade}, the weakest known is {known}"
    return ""


def _rank(grade: str) -> int:
    """Return how strong an adversary is; one whose grade nobody knows counts as the strongest."""
    return GRADES.index(grade) if grade in GRADES else len(GRADES)
