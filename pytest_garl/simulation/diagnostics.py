"""Diagnostics as a flight records them: plain bounded values, or an error that names the field."""

from __future__ import annotations

from typing import Any

from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.simulation.reading import NonsenseError, finite, items, number, numbers, vector
from pytest_garl.simulation.texts import cut, shown

PHASE_CHARS = 100
NOTE_CHARS = 1_000
MOST_DETECTIONS = 100
MOST_CORNERS = 32
MOST_POINTS = 1_000
"""A flight has up to 1,200 frames at the default rate, and its record keeps each of them."""
MOST_MARKER_ID = 2**31


def read_diagnostics(value: Any, field: str) -> Diagnostics | None:
    """Return diagnostics rebuilt from plain values; raise NonsenseError for what is wrong.

    Texts are cut: a phase after 100 characters, a note after 1,000.
    """
    if value is None:
        return None
    try:
        if not isinstance(value, Diagnostics):
            raise NonsenseError(f"{field} = {shown(value)}; expected Diagnostics")
        target = value.target_m
        return Diagnostics(
            phase=cut(str(value.phase), PHASE_CHARS),
            detections=tuple(
                _detection(seen, f"{field}.detections[{index}]")
                for index, seen in enumerate(
                    _items(value.detections, f"{field}.detections", MOST_DETECTIONS)
                )
            ),
            target_m=None if target is None else vector(target, f"{field}.target_m"),
            planned_path_m=tuple(
                vector(point, f"{field}.planned_path_m[{index}]")
                for index, point in enumerate(
                    _items(value.planned_path_m, f"{field}.planned_path_m", MOST_POINTS)
                )
            ),
            note=cut(str(value.note), NOTE_CHARS),
        )
    except NonsenseError as error:
        raise NonsenseError(str(error), "BadDiagnostics") from None


def _detection(value: Any, field: str) -> Detection:
    if not isinstance(value, Detection):
        raise NonsenseError(f"{field} = {shown(value)}; expected Detection")
    return Detection(
        marker_id=_whole(value.marker_id, f"{field}.marker_id"),
        confidence=number(value.confidence, f"{field}.confidence"),
        position_m=vector(value.position_m, f"{field}.position_m"),
        corners_px=tuple(
            _pair(corner, f"{field}.corners_px[{index}]")
            for index, corner in enumerate(
                _items(value.corners_px, f"{field}.corners_px", MOST_CORNERS)
            )
        ),
    )


def _items(value: object, field: str, most: int) -> list[Any]:
    found = items(value, most)
    if found is None:
        raise NonsenseError(f"{field} = {shown(value)}; expected a sequence")
    if len(found) > most:
        raise NonsenseError(f"{field} has more than {most} items; expected at most {most}")
    return found


def _whole(value: object, field: str) -> int:
    found = finite(value)
    if found is None or found != int(found) or abs(found) >= MOST_MARKER_ID:
        raise NonsenseError(f"{field} = {shown(value)}; expected a whole number")
    return int(found)


def _pair(value: object, field: str) -> tuple[float, float]:
    u, v = numbers(value, field, 2)
    return u, v
