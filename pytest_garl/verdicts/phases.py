"""The phase of the landing at a time, from ground truth.

A flight's own heights divide it: where it stopped climbing, and from where it came down.  So a UAV
that searches at 4 m, turns in during its climb or starts in the air has the same phases as one that
searches at 10 m.
"""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.flight.flight import Flight
from pytest_garl.verdicts.touchdowns import stands_since_s

LAST_METRE_M = 1.2
"""Body height at which the feet are one metre above the ground."""
NEAR_MARKER_M = 2.5
"""Horizontal distance from the marker within which a high UAV is on approach."""
LOW_M = 7.0
"""Height at which a take-off ends at the latest; whoever comes down below it is on the descent."""
SUNK_M = 0.5
"""A UAV that is this far below its highest place so far has turned to come down; less is bobbing.
NPCs wait for the same difference (``landing_phases.ABOVE_M``)."""
LEVEL_S = 2.0
"""A UAV that rose less than that in this time before the flight's end had stopped climbing: it was
slower than 0.25 m/s, and the flight control climbs at up to 3 m/s."""
AIRBORNE_M = 1.0
"""Body height from which a UAV has taken off; one that starts higher hovers at its start."""


def landing_phase(flight: Flight, time_s: float) -> str:
    """Return the phase: take-off, transit, search, approach, descent, last-metre or standing."""
    index = int(np.searchsorted(flight.uav.time_s, time_s, side="right")) - 1
    index = max(0, index)
    x, y, z = (float(value) for value in flight.uav.position_m[index])
    if index < flying_from(flight):
        return "take-off"
    if stands_since_s(flight, time_s) is not None:
        return "standing"
    if z <= LAST_METRE_M:
        return "last-metre"
    highest_m = float(flight.uav.position_m[: index + 1, 2].max())
    if z < min(LOW_M, highest_m - SUNK_M):
        return "descent"
    if math.dist((x, y), flight.marker_position_m) < NEAR_MARKER_M:
        return "approach"
    seen = any(step.marker_visible > 0 for step in flight.steps if step.time_s <= time_s)
    return "search" if seen else "transit"


def flying_from(flight: Flight) -> int:
    """Return the first sample of the track after the take-off; its length if there is none.

    The take-off ends where the UAV stops climbing: half a metre below the highest place from which
    it first came down by as much, or at 7 m.  A UAV that starts in the air has none, and a flight
    that ended during its climb is all take-off.
    """
    heights, times = flight.uav.position_m[:, 2], flight.uav.time_s
    if heights[0] >= AIRBORNE_M:
        return 0
    highest = np.maximum.accumulate(heights)
    turned = (highest - heights >= SUNK_M) & (highest >= AIRBORNE_M)
    top_m = float(highest[np.argmax(turned)] if turned.any() else highest[-1])
    end = int(np.argmax(heights >= min(LOW_M, top_m - SUNK_M)))
    levelled = turned.any() or top_m >= LOW_M or times[-1] - times[end] >= LEVEL_S
    return end if levelled and top_m >= AIRBORNE_M else len(heights)
