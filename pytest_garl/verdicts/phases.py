"""In which part of the landing something happened, from ground truth alone."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.flight import Flight

LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
LOW_M = 7.0
UNSEEN_S = 2.0
AT_MARKER_M = 1.5
"""What a system says is so near to the marker, is the marker: as far as its side is long."""
IN_VIEW = 0.5
"""More than this share of the marker in the frame counts as in view."""


def moment(flight: Flight, time_s: float) -> str:
    """Name the moment: take-off, transit, search, approach, descent or last-metre."""
    index = int(np.searchsorted(flight.uav.time_s, time_s, side="right")) - 1
    index = max(0, index)
    x, y, z = flight.uav.position_m[index]
    near = float(np.hypot(x - flight.marker_position_m[0], y - flight.marker_position_m[1]))
    highest = float(flight.uav.position_m[: index + 1, 2].max())
    if highest < LOW_M:
        return "take-off"
    if z <= LAST_METRE_M:
        return "last-metre"
    if z < LOW_M:
        return "descent"
    if near < NEAR_MARKER_M:
        return "approach"
    seen = any(step.marker_visible > 0 for step in flight.steps if step.time_s <= time_s)
    return "search" if seen else "transit"


def was_in_view(flight: Flight, body: str, time_s: float) -> bool:
    """Whether the camera showed a dynamic object within the last two seconds."""
    return any(
        body in step.objects_visible
        for step in flight.steps
        if time_s - UNSEEN_S <= step.time_s <= time_s
    )


def last_sighting_s(flight: Flight) -> float | None:
    """Return when the marker was seen last: by the system's own word, where it gives one.

    What a system detected at the marker's place counts.  If it reports targets alone, each of them
    at that place counts.  If it reports neither, the marker counts where most of it was in the
    frame.  None: it was never seen.
    """
    if reports_detections(flight):
        times = [
            step.time_s
            for step in flight.steps
            if step.diagnostics
            and any(_at_marker(flight, seen.position_m) for seen in step.diagnostics.detections)
        ]
    elif reports_targets(flight):
        times = [
            step.time_s
            for step in flight.steps
            if step.diagnostics
            and step.diagnostics.target_m
            and _at_marker(flight, step.diagnostics.target_m)
        ]
    else:
        times = [step.time_s for step in flight.steps if step.marker_visible > IN_VIEW]
    return max(times, default=None)


def reports_detections(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a detection."""
    return any(step.diagnostics and step.diagnostics.detections for step in flight.steps)


def reports_targets(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a target."""
    return any(step.diagnostics and step.diagnostics.target_m for step in flight.steps)


def _at_marker(flight: Flight, place: tuple[float, ...]) -> bool:
    return math.dist(place[:2], flight.marker_position_m) <= AT_MARKER_M
