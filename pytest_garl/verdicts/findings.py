"""Second reading: what had gone wrong in a flight before the event that decided it."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.verdicts.evidence import AT_MARKER_M, Evidence
from pytest_garl.verdicts.verdict import Finding
from pytest_garl.verdicts.wording import compass_point

DESCENT_WINDOW_S = 3.0
"""Length of the last part of a flight that shows where it was coming down."""
LEAST_SINK_M = 0.5
"""A UAV that sinks less than this in the window is not coming down."""
UNDETECTED_S = 3.0
"""A marker that could be read for this long without being reported was lost."""
SLOW_FACTOR = 3.0
"""A landing is slow from this many times the nominal landing's time on."""
ELSEWHERE = "off:descending-elsewhere"
LOST = "lost-while-detectable"
SLOW = "slow"
REPORTED_ONLY = (SLOW,)
"""Findings that are reported, but not flown again."""


def findings(evidence: Evidence, elsewhere: Finding | None) -> tuple[Finding, ...]:
    """Return what had gone wrong before the flight's end, in the order of time.

    ``elsewhere`` is the descent beside the marker, if :func:`descent_elsewhere` found one.
    """
    found = (elsewhere, _lost_while_detectable(evidence), _slow(evidence))
    return tuple(sorted((each for each in found if each), key=lambda each: each.time_s))


def descent_elsewhere(evidence: Evidence) -> Finding | None:
    """Return that a flight which hit something was coming down beside the marker.

    Both its last place and the place at which its motion of the last seconds would have ended on
    the ground lie beyond the limit, and by more than the marker's length.
    """
    if evidence.hit is None or evidence.hit.body_class == "ground":
        return None
    flight, limit_m = evidence.flight, evidence.limits.distance_m
    times, places = flight.uav.time_s, flight.uav.position_m
    end_s = float(times[-1])
    if evidence.phase_at(end_s) not in ("descent", "last-metre"):
        return None
    start = int(np.searchsorted(times, end_s - DESCENT_WINDOW_S))
    moved = places[-1] - places[start]
    if -float(moved[2]) < LEAST_SINK_M:
        return None
    # The straight line of the last seconds, down to the ground.
    left = feet_height_m(float(places[-1, 2])) / -float(moved[2])
    aim = places[-1, :2] + left * moved[:2]
    marker = flight.marker_position_m
    off_m = min(math.dist(place, marker) for place in (tuple(places[-1, :2]), tuple(aim)))
    if off_m <= max(AT_MARKER_M, limit_m):
        return None
    x, y = float(places[-1, 0] - marker[0]), float(places[-1, 1] - marker[1])
    seen = evidence.readable_until(end_s)
    view = "which had been in view before" if seen else "which had never been readable"
    name = evidence.decoy_at((float(aim[0]), float(aim[1])))
    onto = f" onto {name}" if name else ""
    return Finding(
        signature=f"I:{name}" if onto else ELSEWHERE,
        margin=limit_m - off_m,
        unit="m",
        time_s=float(times[start]),
        story=(
            f"Came down{onto} {math.hypot(x, y):.1f} m {compass_point(x, y)} of the marker, {view}."
        ),
    )


def _lost_while_detectable(evidence: Evidence) -> Finding | None:
    longest, began = evidence.undetected
    if longest < UNDETECTED_S:
        return None
    return Finding(
        signature=LOST,
        margin=UNDETECTED_S - longest,
        unit="s",
        time_s=began,
        story=(
            f"From {began:.1f} s on the marker could be read for {longest:.1f} s, but the system "
            "did not report it."
        ),
    )


def _slow(evidence: Evidence) -> Finding | None:
    nominal_s = evidence.flight.nominal_landing_s
    if evidence.flight.outcome != "landed" or not nominal_s:
        return None
    took_s = evidence.landed_s
    if took_s <= SLOW_FACTOR * nominal_s:
        return None
    return Finding(
        signature=SLOW,
        margin=SLOW_FACTOR * nominal_s - took_s,
        unit="s",
        time_s=SLOW_FACTOR * nominal_s,
        story=(
            f"Landed after {took_s:.1f} s, {took_s / nominal_s:.1f} times as long as a nominal "
            "landing."
        ),
    )
