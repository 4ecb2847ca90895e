"""Excuses: whether anybody could have landed, from ground truth alone.

The path that a landing system chose never excuses it: a system that gives up at once has seen
nothing, and is not excused.  It may show that somebody could have landed: where a flight that
lasted until the time was up could read the marker for long enough, nobody needed another path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import ObjectRecord
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import NO_LANDING, Excuse

READABLE_S = 2.0
"""A nominal landing must be able to read the marker for this long in all: from the search, and
from above the marker; or from above it on a later descent."""
CYLINDER_M = 2.0
"""Radius of the marker's safety cylinder: UAV and body, each half a metre, and a metre between."""
CYLINDER_TOP_M = 4.0
FREE_GAP_S = 10.0
"""The cylinder must be free for this long at a time: a descent of 10 m at 1 m/s."""
BLOCKED_S = 30.0
"""A landing system has to wait at least this long above an occupied marker."""


def excuse(evidence: Evidence) -> tuple[Excuse, str]:
    """Return why nobody could have landed, and the reason in a sentence; both empty if one could.

    A flight that came down has no excuse, and neither has a UAV that stands on the marker.
    """
    if evidence.flight.outcome not in NO_LANDING or evidence.off_marker_m is not None:
        return "", ""
    if evidence.stands_since_s(evidence.gave_up_s) is not None:
        return "", ""
    if _is_undetectable(evidence):
        waits = any(view.attempt for view in evidence.flight.nominal_views)
        attempts = ", also with later attempts, for at most" if waits else " for"
        return "undetectable", (
            "The marker could not be read for long enough: a nominal landing could have read "
            f"it{attempts} {evidence.expected_readable_s:.1f} s in all, and {READABLE_S:g} s are "
            "needed."
        )
    blocked = _blocked(evidence)
    return ("blocked", blocked) if blocked else ("", "")


def _is_undetectable(evidence: Evidence) -> bool:
    """Whether no nominal landing could read the marker for long enough.

    Of a flight that lasted until the time was up its own frames are asked as well: it may have been
    nearer to the marker, or there at a better time.
    """
    if not evidence.flight.nominal_views or evidence.expected_readable_s >= READABLE_S:
        return False
    return not evidence.waited or evidence.readable_s < READABLE_S


def _blocked(evidence: Evidence) -> str:
    """Return that the marker was never free for long enough; empty if it was."""
    flight, gave_up_s = evidence.flight, evidence.gave_up_s
    arrival_s = flight.nominal_arrival_s
    if arrival_s is None or gave_up_s - arrival_s < BLOCKED_S:
        return ""
    times = flight.uav.time_s
    window = (times >= arrival_s) & (times <= gave_up_s)
    occupied = np.zeros(len(times), np.bool_)
    for item in flight.objects:
        occupied |= in_cylinder(item, flight.marker_position_m)
    free_s = _longest_s(times[window], ~occupied[window])
    if free_s >= FREE_GAP_S:
        return ""
    return (
        f"The marker was blocked: from {arrival_s:.0f} s on, people or animals were within "
        f"{CYLINDER_M:g} m of it, and left it free for {free_s:.1f} s at a time at most; "
        f"{FREE_GAP_S:g} s are needed."
    )


def in_cylinder(item: ObjectRecord, marker_m: tuple[float, float]) -> NDArray[np.bool_]:
    """Whether an object is in the safety cylinder at each time of its track."""
    kind = OBJECT_TYPES.get(item.type)
    radius_m = kind.radius_m if kind else 0.0
    bottom_m = kind.low_m if kind else 0.0
    x, y, z = item.track.position_m.T
    near = np.hypot(x - marker_m[0], y - marker_m[1]) - radius_m < CYLINDER_M
    inside: NDArray[np.bool_] = near & (z + bottom_m < CYLINDER_TOP_M)
    return inside


def _longest_s(times_s: NDArray[np.float64], holds: NDArray[np.bool_]) -> float:
    """Return the length of the longest span of time in which something holds."""
    longest, since = 0.0, None
    for time_s, here in zip(times_s.tolist(), holds.tolist(), strict=True):
        if here and since is None:
            since = time_s
        elif not here:
            since = None
        if since is not None:
            longest = max(longest, time_s - since)
    return longest
