"""The phase of the landing at a time, from ground truth."""

from __future__ import annotations

import numpy as np

from pytest_garl.simulation.flight import Flight

LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
"""Horizontal distance from the marker within which a high UAV is on approach."""
LOW_M = 7.0
"""Height at which the take-off ends and below which a flight is a descent."""


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
