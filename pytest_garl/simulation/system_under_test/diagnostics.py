"""Diagnostics as a flight records them: plain bounded values, or an error that names the field."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

from pytest_garl.foreign_text import cut, shown_foreign
from pytest_garl.landing_system import Detection, Diagnostics
from pytest_garl.simulation.system_under_test.reading import (
    NonsenseError,
    Vector,
    are_floats,
    finite,
    items,
    number,
    numbers,
    vector,
)

PHASE_CHARS = 100
NOTE_CHARS = 1_000
MOST_DETECTIONS = 100
MOST_CORNERS = 32
MOST_POINTS = 1_000
POINTS_KEPT = 100
"""A flight has 1,200 frames at the default rate, and its record keeps the path of each."""
MAX_DIAGNOSTICS_BYTES = 24_000_000
"""Largest size of all diagnostics of a flight; ``flight_file.py`` loads records up to 32 MB."""
FULL_SHARE = 0.25
"""Share of these bytes in which paths, corners and notes are recorded too."""
_NUMBER_BYTES, _KEYS_BYTES = 26, 80
"""Largest size in a record, which is JSON in ASCII."""
MOST_MARKER_ID = 2**31


class DiagnosticsQuota:
    """Limits the bytes of a landing system's diagnostics in the record of one flight."""

    def __init__(self) -> None:
        self._left = MAX_DIAGNOSTICS_BYTES

    def shorten(self, diagnostics: Diagnostics, field: str) -> Diagnostics:
        """Return the diagnostics to record.

        Once a quarter of the quota is used, these are only what verdicts need.  Once it is used
        up, raises NonsenseError.
        """
        if self._left < (1 - FULL_SHARE) * MAX_DIAGNOSTICS_BYTES:
            diagnostics = dataclasses.replace(
                diagnostics,
                detections=tuple(
                    dataclasses.replace(seen, corners_px=()) for seen in diagnostics.detections
                ),
                planned_path_m=(),
                note="",
                obstacles_m=None,
            )
        self._left -= _bytes_of(diagnostics)
        if self._left < 0:
            raise NonsenseError(
                f"{field}: those of this flight fill more than {MAX_DIAGNOSTICS_BYTES} "
                "bytes; expected fewer detections in each frame",
                "BadDiagnostics",
            )
        return diagnostics


def _bytes_of(diagnostics: Diagnostics) -> int:
    corners = sum(2 * len(seen.corners_px) for seen in diagnostics.detections)
    points = len(diagnostics.planned_path_m) + len(diagnostics.obstacles_m or ())
    numbers = 3 * points + 5 * len(diagnostics.detections) + corners + 3
    texts = len(json.dumps(diagnostics.phase)) + len(json.dumps(diagnostics.note))
    return _NUMBER_BYTES * numbers + texts + _KEYS_BYTES * (1 + len(diagnostics.detections))


def read_diagnostics(value: Any, field: str) -> Diagnostics | None:
    """Return diagnostics rebuilt from plain values; raise NonsenseError for what is wrong.

    Texts are cut: a phase after 100 characters, a note after 1,000.  Of a path, and of obstacles,
    every k-th point is kept, and the last, so that there are at most 100.
    """
    if value is None:
        return None
    try:
        if not isinstance(value, Diagnostics):
            raise NonsenseError(f"{field} = {shown_foreign(value)}; expected Diagnostics")
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
            planned_path_m=_points(value.planned_path_m, f"{field}.planned_path_m"),
            obstacles_m=None
            if (obstacles := value.obstacles_m) is None
            else _points(obstacles, f"{field}.obstacles_m"),
            note=cut(str(value.note), NOTE_CHARS),
        )
    except NonsenseError as error:
        raise NonsenseError(str(error), "BadDiagnostics") from None


def _detection(value: Any, field: str) -> Detection:
    if not isinstance(value, Detection):
        raise NonsenseError(f"{field} = {shown_foreign(value)}; expected Detection")
    return Detection(
        marker_id=_whole(value.marker_id, f"{field}.marker_id"),
        confidence=number(value.confidence, f"{field}.confidence"),
        position_m=vector(value.position_m, f"{field}.position_m"),
        corners_px=tuple(
            corner if are_floats(corner, 2) else _pair(corner, f"{field}.corners_px[{i}]")
            for i, corner in enumerate(
                _items(value.corners_px, f"{field}.corners_px", MOST_CORNERS)
            )
        ),
    )


def _points(value: object, field: str) -> tuple[Vector, ...]:
    return _thinned(
        [
            point if are_floats(point, 3) else vector(point, f"{field}[{i}]")
            for i, point in enumerate(_items(value, field, MOST_POINTS))
        ]
    )


def _thinned(path: list[Vector]) -> tuple[Vector, ...]:
    every = math.ceil((len(path) - 1) / (POINTS_KEPT - 1)) if len(path) > POINTS_KEPT else 1
    kept = path[::every]
    return (*kept, path[-1]) if kept and kept[-1] is not path[-1] else tuple(kept)


def _items(value: object, field: str, most: int) -> list[Any]:
    found = items(value, most)
    if found is None:
        raise NonsenseError(f"{field} = {shown_foreign(value)}; expected a sequence")
    if len(found) > most:
        raise NonsenseError(f"{field} has more than {most} items; expected at most {most}")
    return found


def _whole(value: object, field: str) -> int:
    found = finite(value)
    if found is None or found != int(found) or abs(found) >= MOST_MARKER_ID:
        raise NonsenseError(f"{field} = {shown_foreign(value)}; expected a whole number")
    return int(found)


def _pair(value: object, field: str) -> tuple[float, float]:
    u, v = numbers(value, field, 2)
    return u, v
