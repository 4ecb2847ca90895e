"""What a page shows of one flight, as plain values: path, margins over time, events, facts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.detectability import readable_probability
from pytest_garl.flight.flight import Flight, ObjectRecord, Step, Track
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, feet_height_m
from pytest_garl.messages import shortened
from pytest_garl.reports.html.moments import Moment, telling_moment
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.verdicts.evidence import Evidence, Report

MOST_SAMPLES = 900
"""More samples than a chart of a wide screen has pixels for; a page stays small."""
UAV_RADIUS_M = 0.5
"""A UAV of 1 m from tip to tip (docs/verdicts.md)."""
PLAN_STEP_S = 0.5
MOST_PLAN_POINTS = 24
WORDS = 80
MOST_PHASES = 200
"""A landing system that names each frame a phase of its own fills no page."""
MOST_DECOYS = 50
UNKNOWN_SIZE_M = (0.3, 1.0, 0.0)
"""Radius, height and lower end that stand for an NPC of a simulator of the user's own."""
Array = NDArray[np.float64]
Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Strip:
    """The spans of time in which something held."""

    name: str
    kind: str
    spans: tuple[Span, ...]


def flight_data(evidence: Evidence, moments: Sequence[Moment]) -> dict[str, Any]:
    """Return the values that path, timeline and cursor of a page draw, for JSON."""
    flight = evidence.flight
    picked = _picked(flight.uav.time_s)
    opens = telling_moment(evidence, moments)
    times = flight.uav.time_s[picked]
    return {
        "end_s": round(float(flight.elapsed_s), 2),
        "opens_s": round(opens.time_s if opens else evidence.decided_s, 2),
        "marker": [round(each, 2) for each in flight.marker_position_m],
        "t": _rounded(times),
        "uav": _path(flight.uav, picked, lift_m=-BODY_ABOVE_FEET_M),
        "objects": [_object(each, picked) for each in flight.objects],
        "decoys": [
            [shortened(name, WORDS), round(x, 2), round(y, 2)]
            for name, x, y in flight.decoys[:MOST_DECOYS]
        ],
        "metres": _metres(evidence, picked),
        "percent": _percent(flight, times),
        "strips": [
            {"name": each.name, "kind": each.kind, "spans": each.spans} for each in strips(evidence)
        ],
        "phases": [[a, b, name] for a, b, name in phases(flight.steps, flight.elapsed_s)],
        "targets": _targets(evidence),
        "plans": _plans(flight.steps),
        "moments": [{"t": round(each.time_s, 2), "label": each.label} for each in moments],
    }


def _picked(times: Array) -> NDArray[np.intp]:
    """Return the indices of evenly picked samples, the last one among them."""
    stride = max(1, math.ceil(len(times) / MOST_SAMPLES))
    picked = np.arange(0, len(times), stride)
    last = len(times) - 1
    return picked if picked[-1] == last else np.append(picked, last)


def _rounded(values: Iterable[float], digits: int = 2) -> list[float]:
    return [round(float(value), digits) for value in values]


def _path(track: Track, picked: NDArray[np.intp], lift_m: float = 0.0) -> dict[str, list[float]]:
    x, y, z = track.position_m[picked].T
    return {"x": _rounded(x), "y": _rounded(y), "z": _rounded(z + lift_m)}


def _object(item: ObjectRecord, picked: NDArray[np.intp]) -> dict[str, Any]:
    radius_m, height_m, low_m = _size_m(item)
    return {
        "name": item.name,
        "type": item.type,
        "radius_m": round(radius_m, 2),
        "height_m": round(height_m, 2),
        "low_m": round(low_m, 2),
        **_path(item.track, picked),
    }


def _size_m(item: ObjectRecord) -> tuple[float, float, float]:
    """Return radius, height and lower end of the upright cylinder that stands for an NPC."""
    kind = OBJECT_TYPES.get(item.type)
    return (kind.radius_m, kind.height_m, kind.low_m) if kind else UNKNOWN_SIZE_M


def _metres(evidence: Evidence, picked: NDArray[np.intp]) -> list[dict[str, Any]]:
    """Return the lines of the chart in metres: name, colour's name, values; gaps are null."""
    flight = evidence.flight
    x, y, z = flight.uav.position_m[picked].T
    mx, my = flight.marker_position_m
    lines = [
        _line("height above the ground", "height", [feet_height_m(float(each)) for each in z]),
        _line("UAV to the marker's centre", "marker", np.hypot(x - mx, y - my)),
    ]
    if flight.objects:
        lines.append(_line("gap to the nearest NPC", "npc", gap_m(flight)[picked]))
    times = flight.uav.time_s[picked]
    if evidence.targets:
        off = [(time_s, math.dist(place, (mx, my))) for time_s, place in evidence.targets]
        lines.append(_line("system's target off the marker", "target", _held(off, times)))
    errors = [(s.time_s, math.hypot(*s.estimation_error_m)) for s in flight.steps]
    if max((error for _, error in errors), default=0.0) >= 0.1:
        lines.append(_line("error of the estimated position", "error", _held(errors, times)))
    if flight.rangefinder:
        lines.append(_line("rangefinder's reading", "laser", _readings(flight, times)))
    return lines


def _readings(flight: Flight, times: Array) -> list[float | None]:
    """Return the rangefinder's reading at each time, None where it had none."""
    gaps = [
        (s.time_s, math.nan if s.rangefinder_m is None else s.rangefinder_m) for s in flight.steps
    ]
    held = _held(gaps, times)
    return [None if value is None or math.isnan(value) else value for value in held]


def _line(name: str, kind: str, values: Iterable[float | None]) -> dict[str, Any]:
    shown = [None if v is None else round(float(v), 2) for v in values]
    return {"name": name, "kind": kind, "values": shown}


def gap_m(flight: Flight) -> Array:
    """Return the gap between the UAV and the nearest NPC over the track, shape (n,), in metres.

    Both are upright cylinders here; the record has the exact distances only where they are least.
    """
    least = np.full(len(flight.uav.time_s), np.inf)
    ux, uy, uz = flight.uav.position_m.T
    for item in flight.objects:
        radius_m, height_m, low_m = _size_m(item)
        x, y, z = item.track.position_m.T
        across = np.maximum(0.0, np.hypot(x - ux, y - uy) - radius_m - UAV_RADIUS_M)
        bottom = z + low_m
        above = np.maximum(uz - BODY_ABOVE_FEET_M - (bottom + height_m), bottom - uz)
        least = np.minimum(least, np.hypot(across, np.maximum(0.0, above)))
    return least


def _held(values: Sequence[tuple[float, float]], times: Array) -> list[float | None]:
    """Return at each time the last value before it, None if there is none within a second."""
    if not values:
        return [None] * len(times)
    known = np.array([time_s for time_s, _ in values])
    index = np.searchsorted(known, times, side="right") - 1
    return [
        float(values[i][1]) if i >= 0 and time_s - known[i] <= 1.0 else None
        for i, time_s in zip(index.tolist(), times, strict=True)
    ]


def _percent(flight: Flight, times: Array) -> list[dict[str, Any]]:
    """Return the lines of the chart in per cent."""
    steps = flight.steps
    recorded = any(step.marker is not None for step in steps)
    visible = [(step.time_s, 100 * step.marker_visible) for step in steps]
    lines = [_line("marker unhidden in the picture", "visible", _held(visible, times))]
    if recorded:
        chance = [(step.time_s, 100 * readable_probability(step.marker)) for step in steps]
        lines.insert(0, _line("chance that it can be read", "readable", _held(chance, times)))
    return lines


def strips(evidence: Evidence) -> tuple[Strip, ...]:
    """Return what held when: the marker could be read, the system reported it, NPCs in view."""
    reports = evidence.reports
    readable = {step.time_s for step in evidence.readable}
    found = [_strip("marker can be read", "readable", reports, lambda r: r.step.time_s in readable)]
    if evidence.reports_detections:
        seen = _strip("system reports it", "reported", reports, lambda r: r.marker)
        other = _strip("system reports another place", "other", reports, lambda r: r.elsewhere)
        found += [each for each in (seen, other) if each.spans or each is seen]
    elif evidence.targets:
        found.append(_strip("system has a target", "reported", reports, lambda r: bool(r.target_m)))
    for item in evidence.flight.objects:
        strip = _strip(
            f"{item.name} in view",
            "npc",
            reports,
            lambda r, name=item.name: name in r.step.objects_visible,
        )
        if strip.spans:
            found.append(strip)
    return tuple(found)


def _strip(name: str, kind: str, reports: Sequence[Report], holds: Any) -> Strip:
    spans: list[Span] = []
    steps = [each.step for each in reports]
    frame_s = steps[1].time_s - steps[0].time_s if len(steps) > 1 else 0.1
    for report, step in zip(reports, steps, strict=True):
        if holds(report):
            end = round(step.time_s + frame_s, 2)
            if spans and step.time_s - spans[-1][1] < frame_s / 2:
                spans[-1] = (spans[-1][0], end)
            else:
                spans.append((round(step.time_s, 2), end))
    return Strip(name=name, kind=kind, spans=tuple(spans))


def phases(steps: Sequence[Step], end_s: float) -> list[tuple[float, float, str]]:
    """Return the landing system's own phases: from when to when, and their names."""
    found: list[tuple[float, float, str]] = []
    for step in steps:
        name = step.diagnostics.phase if step.diagnostics else ""
        name = shortened(name, WORDS)
        if not found or found[-1][2] != name:
            found.append((round(step.time_s, 2), round(end_s, 2), name))
            if len(found) > 1:
                found[-2] = (found[-2][0], round(step.time_s, 2), found[-2][2])
    return [each for each in found if each[2]][:MOST_PHASES]


def _targets(evidence: Evidence) -> list[list[float]]:
    """Return (time, x, y) of the system's target where it changed by more than a decimetre."""
    found: list[list[float]] = []
    for time_s, place in evidence.targets:
        if not found or math.dist(place, (found[-1][1], found[-1][2])) > 0.1:
            found.append(_rounded((time_s, *place)))
    return found


def _plans(steps: Sequence[Step]) -> list[list[Any]]:
    """Return (time, points) of the system's planned paths, at most two in a second."""
    found: list[list[Any]] = []
    for step in steps:
        points = step.diagnostics.planned_path_m if step.diagnostics else ()
        if points and (not found or step.time_s - found[-1][0] >= PLAN_STEP_S):
            stride = math.ceil(len(points) / MOST_PLAN_POINTS)
            kept = [*points[::stride], points[-1]]
            found.append([round(step.time_s, 2), [_rounded(point) for point in kept]])
    return found
