"""Touchdowns in a flight's record, and when a flight landed or was given up."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.simulation.flight import Flight, Touchdown
from pytest_garl.verdicts.verdict import Limits

ON_GROUND_M = 0.02
"""After its first contact with the ground, the UAV counts as on the ground up to this much above
its height at the contact, because it may rebound a little."""


def landed_s(flight: Flight) -> float:
    """Return the time of the touchdown; the flight's end for simulators that record none."""
    return flight.touchdown.time_s if flight.touchdown else flight.elapsed_s


def gave_up_s(flight: Flight) -> float:
    """Return when the landing was given up: at the command, or when the time was over."""
    return next((e.time_s for e in flight.events if e.name == "abort_command"), flight.elapsed_s)


def touchdown_off_marker(flight: Flight, limits: Limits) -> Touchdown | None:
    """Return the first touchdown beyond the limit that was not a landing; None if there was none.

    The UAV took off again, slid on, gave up, or was hit where it stood.
    """
    found = list(flight.earlier_touchdowns)
    hard = flight.outcome == "collision" and flight.contacts[-1].body_class == "ground"
    if flight.touchdown and flight.outcome != "landed" and not hard:
        found.append(flight.touchdown)
    if not found and flight.outcome in ("gave_up", "not_landed"):
        return _from_track(flight, limits)
    return next((each for each in found if each.distance_m > limits.distance_m), None)


def _from_track(flight: Flight, limits: Limits) -> Touchdown | None:
    """Find the first place on the ground beyond the limit, for simulators without touchdowns.

    The record's contacts hold only the first one with the ground; later ones follow from the
    height.
    """
    first = next((each for each in flight.contacts if each.body_class == "ground"), None)
    if first is None:
        return None
    track = flight.uav
    start = max(0, int(np.searchsorted(track.time_s, first.time_s, side="right")) - 1)
    # The sample before a contact lies above the ground, the one after it on the ground.
    height = float(track.position_m[start : start + 2, 2].min()) + ON_GROUND_M
    mx, my = flight.marker_position_m
    for index in range(start, len(track.time_s)):
        x, y, z = (float(value) for value in track.position_m[index])
        off_m = math.hypot(x - mx, y - my)
        if (index == start or z <= height) and off_m > limits.distance_m:
            return Touchdown(
                time_s=max(first.time_s, float(track.time_s[index])),
                position_m=(x, y, z),
                distance_m=off_m,
                speed_mps=first.speed_mps,
                tilt_rad=first.tilt_rad,
                on="nothing",
            )
    return None
