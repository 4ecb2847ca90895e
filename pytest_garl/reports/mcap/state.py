"""The topics ``/state``, ``/sight`` and ``/margins``: numbers over time, for charts."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pytest_garl.flight.detectability import readable_probability
from pytest_garl.flight.flight import Flight, Step
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, HARD_TOUCHDOWN_MPS, UPRIGHT_RAD
from pytest_garl.reports.html.flight_view import gap_m
from pytest_garl.reports.mcap.numbers import Numbers
from pytest_garl.reports.mcap.values import Logged, ns
from pytest_garl.verdicts.evidence import target_of
from pytest_garl.verdicts.verdict import Limits

STATE, SIGHT, MARGINS = "/state", "/sight", "/margins"


def states(flight: Flight, limits: Limits) -> Iterator[Logged]:
    """Yield heights, speeds and distances at each sample, and what they leave of the limits.

    A margin is that of a flight that would touch down at this sample, as it is then: what is left
    of a limit, negative beyond it.  The margins of the verdict are those of the whole flight.
    """
    track = flight.uav
    (x, y, z), (vx, vy, vz) = track.position_m.T, track.velocity_mps.T
    qx, qy = track.attitude[:, 0], track.attitude[:, 1]
    tilt = np.arccos(np.clip(1 - 2 * (qx * qx + qy * qy), -1.0, 1.0))
    off = np.hypot(x - flight.marker_position_m[0], y - flight.marker_position_m[1])
    gap = gap_m(flight)
    for index, time_s in enumerate(track.time_s.tolist()):
        gap_now = float(gap[index]) if flight.objects else math.nan
        state = {
            "height_m": float(z[index]) - BODY_ABOVE_FEET_M,
            "to_marker_m": float(off[index]),
            "across_mps": math.hypot(vx[index], vy[index]),
            "up_mps": float(vz[index]),
            "tilt_rad": float(tilt[index]),
            "to_nearest_npc_m": gap_now,
        }
        margins = {
            "distance_m": limits.distance_m - float(off[index]),
            "time_s": limits.time_s - time_s,
            "moving_m": gap_now,
            "touchdown_speed_mps": HARD_TOUCHDOWN_MPS - max(0.0, -float(vz[index])),
            "touchdown_tilt_rad": UPRIGHT_RAD - float(tilt[index]),
        }
        time_ns = ns(time_s)
        yield _numbers(time_ns, STATE, "State", state)
        yield _numbers(time_ns, MARGINS, "Margins", margins)


def sights(flight: Flight) -> Iterator[Logged]:
    """Yield what each picture shows of the marker, and how far the system's beliefs are off.

    They are at the time at which the system got the picture.
    """
    for step in flight.steps:
        found = step.diagnostics.detections if step.diagnostics else ()
        sight = {
            "marker_visible": step.marker_visible,
            "marker_readable": _readable(step),
            "marker_px": step.marker_px,
            "reported_markers": float(len(found)),
            "target_off_m": _target_off_m(flight, step),
            "position_error_m": math.hypot(*step.estimation_error_m),
            "rangefinder_m": math.nan if step.rangefinder_m is None else step.rangefinder_m,
        }
        yield _numbers(ns(step.time_s), SIGHT, "Sight", sight)


def _readable(step: Step) -> float:
    if step.marker is None:
        return 0.0 if step.marker_visible == 0 else math.nan
    return readable_probability(step.marker)


def _target_off_m(flight: Flight, step: Step) -> float:
    place = target_of(step)
    return math.nan if place is None else math.dist(place, flight.marker_position_m)


def _numbers(time_ns: int, topic: str, name: str, values: dict[str, float]) -> Logged:
    return Logged(time_ns=time_ns, topic=topic, message=Numbers(name=name, values=values))
