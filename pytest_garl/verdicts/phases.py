"""The phase of the landing at a time, and sightings of the marker, from ground truth."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.flight import Flight

LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
"""Horizontal distance from the marker within which a high UAV is on approach."""
LOW_M = 7.0
"""Height at which the take-off ends and below which a flight is a descent."""
UNSEEN_S = 2.0
"""An object counts as seen if it was in the frame this long before."""
AT_MARKER_M = 1.5
"""A detection or target within this distance of the marker is the marker: the length of its side.
"""
IN_VIEW_SHARE = 0.5
"""The marker is in view if more than this share of it is in the frame."""


def landing_phase(flight: Flight, time_s: float) -> str:
    """Return the phase: take-off, transit, search, approach, descent or last-metre."""
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
    """Whether the camera showed a dynamic object within two seconds before ``time_s``."""
    return any(
        body in step.objects_visible
        for step in flight.steps
        if time_s - UNSEEN_S <= step.time_s <= time_s
    )


def last_sighting_s(flight: Flight) -> float | None:
    """Return the time of the last sighting of the marker; None if it was never seen.

    If the system reports detections, each detection at the marker's place is a sighting.  If it
    reports targets alone, each target at that place is one.  If it reports neither, each frame
    that shows most of the marker is one.
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
        times = [step.time_s for step in flight.steps if step.marker_visible > IN_VIEW_SHARE]
    return max(times, default=None)


def reports_detections(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a detection."""
    return any(step.diagnostics and step.diagnostics.detections for step in flight.steps)


def reports_targets(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a target."""
    return any(step.diagnostics and step.diagnostics.target_m for step in flight.steps)


def _at_marker(flight: Flight, place: tuple[float, ...]) -> bool:
    return math.dist(place[:2], flight.marker_position_m) <= AT_MARKER_M
