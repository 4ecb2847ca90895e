"""Sightings of the marker in a flight: by ground truth, and by what the landing system reports.

Ground truth decides types: a marker counts as seen in a frame in which it can be read.  Reports
of the landing system only add to the text.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from pytest_garl.flight.flight import Flight, Step
from pytest_garl.verdicts.detectability import READABLE, readable_probability

AT_MARKER_M = 1.5
"""A detection or target within this distance of the marker is the marker: the length of its side.
"""
IN_VIEW_SHARE = 0.5
"""Without a record of how a picture shows the marker, it counts as seen from this share on."""
UNSEEN_S = 2.0
"""An object counts as seen if it was in the frame this long before."""
Place = tuple[float, float]


def was_in_view(flight: Flight, body: str, time_s: float) -> bool:
    """Whether the camera showed a dynamic object within two seconds before ``time_s``."""
    return any(
        body in step.objects_visible
        for step in flight.steps
        if time_s - UNSEEN_S <= step.time_s <= time_s
    )


def readable_steps(flight: Flight, until_s: float = math.inf) -> Iterator[Step]:
    """Yield the frames up to a time in which the marker could be read, from ground truth.

    Simulators that do not record how a frame shows the marker are judged by its visible share.
    """
    recorded = any(step.marker is not None for step in flight.steps)
    for step in flight.steps:
        if step.time_s > until_s:
            break
        if recorded:
            seen = readable_probability(step.marker) >= READABLE
        else:
            seen = step.marker_visible > IN_VIEW_SHARE
        if seen:
            yield step


def reports_detections(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a detection."""
    return any(step.diagnostics and step.diagnostics.detections for step in flight.steps)


def reports_targets(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a target."""
    return any(step.diagnostics and step.diagnostics.target_m for step in flight.steps)


def reports_anything(flight: Flight) -> bool:
    """Whether the diagnostics of any step hold a detection or a target."""
    return reports_detections(flight) or reports_targets(flight)


def reports_marker(flight: Flight, step: Step) -> bool:
    """Whether the system reports a detection at the marker's place in a frame."""
    found = step.diagnostics.detections if step.diagnostics else ()
    return any(
        math.dist(_in_world(step, seen.position_m), flight.marker_position_m) <= AT_MARKER_M
        for seen in found
    )


def reports_other_place(flight: Flight, step: Step) -> bool:
    """Whether the system reports detections in a frame, and none of them at the marker."""
    seen = step.diagnostics.detections if step.diagnostics else ()
    return bool(seen) and not reports_marker(flight, step)


def target_of(step: Step) -> Place | None:
    """Return the place (x, y) in the world that the system reports as its target, None if none.

    The system reports it in its own frame, so the error of its position is subtracted.
    """
    target = step.diagnostics.target_m if step.diagnostics else None
    return _in_world(step, target) if target else None


def last_target(flight: Flight, until_s: float) -> Place | None:
    """Return the last target (x, y) that the system reported up to a time."""
    for step in reversed(flight.steps):
        if step.time_s <= until_s and (target := target_of(step)):
            return target
    return None


def last_report_s(flight: Flight, until_s: float) -> float | None:
    """Return when the system last reported the marker at its place: a detection, or else a target.

    None if it never did.
    """
    times = (step.time_s for step in reporting_steps(flight, flight.steps))
    return max((time_s for time_s in times if time_s <= until_s), default=None)


def reporting_steps(flight: Flight, steps: Iterable[Step]) -> list[Step]:
    """Return the frames in which the system reports the marker at its place.

    By a detection; of a system that reports none, by a target.
    """
    if reports_detections(flight):
        return [step for step in steps if reports_marker(flight, step)]
    marker = flight.marker_position_m
    targets = ((step, target_of(step)) for step in steps)
    return [step for step, place in targets if place and math.dist(place, marker) <= AT_MARKER_M]


def _in_world(step: Step, place: tuple[float, ...]) -> Place:
    error = step.estimation_error_m
    return place[0] - error[0], place[1] - error[1]
