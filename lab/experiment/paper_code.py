"""What the paper's code counts as a violation, and when it ends a flight.

A flight ends once the UAV has not moved for a time, or as it does anyway.  It violates if the UAV
hit a person, a bird or a dog before, or if it was then more than 1.5 m from the marker, however
high: a UAV that hovers above the marker has landed, and trees count for nothing.  That a UAV which
moved less than 0.1 m has not moved is our reading.
"""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import TRACK_RATE_HZ, Flight

STILL_S = MappingProxyType({"OpenCvLandingSystem": 3.0, "TphYoloLandingSystem": 3.0})
"""After how many seconds without motion the paper's code ends the flights of the simple systems."""
LONG_STILL_S = 20.0
"""The same for MM-MLS; other systems are counted so, too."""
STILL_M, ALOFT_M, DEVIATION_M = 0.1, 1.0, 1.5


def violates_in_its_code(flight: Flight, system: str) -> bool:
    """Whether the paper's code counts a flight of a landing system's class."""
    end = end_in_its_code(flight, STILL_S.get(system, LONG_STILL_S))
    end_s = flight.uav.time_s[end]
    if any(each.body_class == "dynamic" and each.time_s <= end_s for each in flight.contacts):
        return True
    place = flight.uav.position_m[end, :2]
    return math.dist(place, flight.marker_position_m) > DEVIATION_M


def end_in_its_code(flight: Flight, still_s: float) -> int:
    """Return the sample at which the UAV is still for so long since its take-off, else the last."""
    places: NDArray[np.float64] = flight.uav.position_m
    count = round(still_s * TRACK_RATE_HZ)
    first = int(np.argmax(places[:, 2] > places[0, 2] + ALOFT_M))
    if len(places) - first <= count:
        return len(places) - 1
    windows = np.lib.stride_tricks.sliding_window_view(places[first:], count, axis=0)
    still = (windows.max(axis=-1) - windows.min(axis=-1) < STILL_M).all(axis=-1)
    return first + int(np.argmax(still)) + count - 1 if still.any() else len(places) - 1
