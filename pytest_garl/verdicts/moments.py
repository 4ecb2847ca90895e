"""In which part of the landing something happened, from ground truth alone."""

from __future__ import annotations

import numpy as np

from pytest_garl.simulation.flight import Flight

LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
LOW_M = 7.0
UNSEEN_S = 2.0


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


def last_sighting_s(flight: Flight, marker_radius_m: float = 1.5) -> float | None:
    """When the system last said that it saw something at the marker's place, if it says so."""
    mx, my = flight.marker_position_m
    times = [
        step.time_s
        for step in flight.steps
        if step.diagnostics
        for seen in step.diagnostics.detections
        if np.hypot(seen.position_m[0] - mx, seen.position_m[1] - my) <= marker_radius_m
    ]
    return max(times, default=None)


def speaks(flight: Flight) -> bool:
    """Whether the system gives diagnostics with detections or targets at all."""
    return any(
        step.diagnostics and (step.diagnostics.detections or step.diagnostics.target_m)
        for step in flight.steps
    )
