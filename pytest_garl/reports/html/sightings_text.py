"""What the camera showed and when, and what the landing system made of it, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pytest_garl.cases.case import OBSERVED_WITHIN_S
from pytest_garl.cases.observability import OBSERVABLE_PX, pixels_of
from pytest_garl.flight.flight import Step
from pytest_garl.flight.thresholds import feet_height_m
from pytest_garl.messages import shortened
from pytest_garl.reports.html.flight_view import gap_m, phases
from pytest_garl.verdicts.evidence import Evidence

MOST_PHASES = 8


def sighting_sentences(evidence: Evidence) -> tuple[str, ...]:
    """Return the sentences in the order of a landing: the marker, the reports, the body."""
    if not evidence.flight.steps:
        return ("The record holds no camera frames.",)
    end_s = evidence.decided_s
    steps = [step for step in evidence.flight.steps if step.time_s <= end_s]
    return (*_marker(evidence, steps), *_body(evidence, steps), *_phases(steps, end_s))


def readable_and_reported(evidence: Evidence) -> tuple[int, int]:
    """Return in how many frames the marker could be read, and in how many of these reported."""
    readable = evidence.readable_until(evidence.decided_s)
    reporting = {id(step) for step in evidence.reporting}
    return len(readable), sum(id(step) in reporting for step in readable)


def _marker(evidence: Evidence, steps: Sequence[Step]) -> Iterator[str]:
    end_s = evidence.decided_s
    readable = evidence.readable_until(end_s)
    if not readable:
        in_frame = sum(step.marker_visible > 0 for step in steps)
        yield (
            f"The marker could not be read in any of {len(steps)} frames; "
            f"a part of it was in the picture in {in_frame}."
        )
    else:
        yield (
            f"The marker could be read in {len(readable)} of {len(steps)} frames, first at "
            f"{readable[0].time_s:.1f} s and last at {readable[-1].time_s:.1f} s."
        )
    if not evidence.reports_anything:
        yield "The landing system reports neither detections nor a target."
        return
    what = "reported it" if evidence.reports_detections else "had a target at it"
    told = [step.time_s for step in evidence.reporting if step.time_s <= end_s]
    if not told:
        yield f"The landing system never {what}."
        return
    _, both = readable_and_reported(evidence)
    of = f"in {both} of these {len(readable)} frames, " if readable else ""
    yield f"The landing system {what} {of}first at {told[0]:.1f} s and last at {told[-1]:.1f} s."


def _body(evidence: Evidence, steps: Sequence[Step]) -> Iterator[str]:
    flight, contact = evidence.flight, evidence.hit
    if contact is None or contact.body_class != "dynamic":
        return
    body = contact.body
    seen = [step.time_s for step in steps if body in step.objects_visible]
    if not seen:
        yield f"The camera never showed {body} before the contact at {contact.time_s:.1f} s."
        return
    frames = f"{len(seen)} frame{'s' if len(seen) > 1 else ''}"
    index = min(int(np.searchsorted(flight.uav.time_s, seen[0])), len(flight.uav.time_s) - 1)
    up = feet_height_m(float(flight.uav.position_m[index, 2]))
    yield (
        f"The camera showed {body} in {frames}, first at {seen[0]:.1f} s, which is "
        f"{contact.time_s - seen[0]:.1f} s before the contact: the UAV was {up:.1f} m up, and the "
        f"nearest NPC {float(gap_m(flight)[index]):.1f} m away."
    )
    recent = [s for s in steps if s.time_s >= contact.time_s - OBSERVED_WITHIN_S]
    shown = [pixels_of(step, body) for step in recent if body in step.objects_visible]
    large = sum(px >= OBSERVABLE_PX for px in shown)
    counted = f"{len(shown)} of these frames, {large} of them with {OBSERVABLE_PX} pixels or more"
    yield (
        f"For an escape only the last {OBSERVED_WITHIN_S:g} s before the contact count: they have "
        f"{counted if shown else 'none of these frames'}."
    )


def _phases(steps: Sequence[Step], end_s: float) -> Iterator[str]:
    named = [(start, name) for start, _, name in phases(steps, end_s)]
    if named:
        told = [f"{shortened(name, 40)} from {start:.1f} s" for start, name in named]
        if len(told) > MOST_PHASES:
            left = len(told) - MOST_PHASES
            told = [*told[:2], f"{left} more", *told[2 - MOST_PHASES :]]
        yield f"The system's own phases: {', '.join(told)}."
