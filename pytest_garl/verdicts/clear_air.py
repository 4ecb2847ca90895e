"""Why a flight in clear air did not land: what ``garl check`` says of a system that never lands."""

from __future__ import annotations

import math
import statistics

import numpy as np

from pytest_garl.flight.flight import Flight
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.verdict import Verdict
from pytest_garl.verdicts.wording import headline

NEVER_OFF = "it never left the ground"
STAY_M, STAY_S = 0.5, 5.0
"""A UAV that was this near to its last place for this time stayed there."""


def why_no_landing(evidence: Evidence, verdict: Verdict) -> str:
    """Return in one or two sentences why a flight in clear air did not land within the limits."""
    flight, end_s = evidence.flight, evidence.gave_up_s
    if flight.outcome == "gave_up":
        what = f"it gave up at {end_s:.1f} s, {place_beside_marker(flight, end_s)}"
    elif flight.outcome == "not_landed" and verdict.violation:
        landing_s = next((s.time_s for s in flight.steps if s.command == "Land"), None)
        commanded = (
            "it never commanded a landing"
            if landing_s is None
            else f"it commanded a landing at {landing_s:.1f} s"
        )
        what = f"{commanded}; {_last_stay(flight)}"
    else:
        what = f"it {headline(verdict.story)}"
        if flight.outcome != "landed":
            return f"{what}."
    return f"{what}. {seen_text(evidence)}"


def _last_stay(flight: Flight) -> str:
    """Return where a flight was in the end, and since when if it had stayed there."""
    track, end_s = flight.uav, flight.elapsed_s
    if feet_height_m(float(track.position_m[:, 2].max())) < STAY_M:
        return NEVER_OFF
    moved = np.linalg.norm(track.position_m - track.position_m[-1], axis=1) > STAY_M
    since_s = float(track.time_s[np.nonzero(moved)[0][-1] + 1]) if moved.any() else 0.0
    if end_s - since_s < STAY_S:
        return f"at {end_s:.0f} s it was {place_beside_marker(flight, end_s)}"
    stayed = "stood on the ground"
    if feet_height_m(float(track.position_m[-1, 2])) >= STAY_M:
        stayed = f"hovered {place_beside_marker(flight, end_s)}"
    else:
        stayed += f", {math.dist(track.position_m[-1, :2], flight.marker_position_m):.1f} m off"
    return f"from {since_s:.0f} s to the end at {end_s:.0f} s it {stayed}"


def seen_text(evidence: Evidence) -> str:
    """Return in how many pictures the marker could be read, and what the system reported of it."""
    flight, end_s = evidence.flight, evidence.gave_up_s
    if flight.data_read is not None and "image" not in flight.data_read:
        return "It never looked at a picture."
    pictures = sum(step.time_s <= end_s for step in flight.steps)
    readable = len(evidence.readable_until(end_s))
    if not readable:
        return f"The marker could be read in none of its {pictures} pictures."
    text = f"The marker could be read in {readable} of its {pictures} pictures"
    if not evidence.reports_anything:
        return f"{text}; it reported no detection, so nobody can say whether it saw the marker."
    found = sum(step.time_s <= end_s for step in evidence.reporting)
    if not evidence.reports_detections:
        return f"{text}, and it named its place as the target in {found or 'none'}."
    return f"{text}, and it detected it at its place in {found or 'none'}{_elsewhere(evidence)}."


def _elsewhere(evidence: Evidence) -> str:
    """Return in how many pictures a system saw markers at other places only, and how far off."""
    reports = [each for each in evidence.reports if each.step.time_s <= evidence.gave_up_s]
    off_m = [each.off_m for each in reports if each.off_m is not None and not each.marker]
    if not off_m:
        return ""
    return f", elsewhere in {len(off_m)} ({statistics.median(off_m):.1f} m off in the median)"


def place_beside_marker(flight: Flight, time_s: float) -> str:
    """Return such as ``4.6 m up and 0.3 m from the marker``."""
    x, y, z = (float(value) for value in flight.uav.position_m[flight.uav.index_at(time_s)])
    beside_m = math.dist((x, y), flight.marker_position_m)
    return f"{feet_height_m(z):.1f} m up and {beside_m:.1f} m from the marker"
