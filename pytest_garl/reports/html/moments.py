"""The moments of a flight that explain it: the marker is seen, lost, the end nears."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.flight.detectability import readable_probability
from pytest_garl.flight.flight import Flight, Step
from pytest_garl.flight.thresholds import COMMIT_M, feet_height_m
from pytest_garl.verdicts.evidence import LOW_M, Evidence
from pytest_garl.verdicts.verdict import NO_LANDING

MOST = 8
"""Pictures that fit in two rows and tell a flight."""
BEFORE_END_S = 2.0
SAME_S = 0.25
"""Moments that are nearer than this share a picture."""
CLOSE_M = 1.0
"""Below this height the camera sees little more than a part of what the UAV lands on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """A time of the flight, and what happens then."""

    time_s: float
    label: str


def moments_of(evidence: Evidence) -> tuple[Moment, ...]:
    """Return the moments in the order of time; those at almost the same time are one.

    Of too many the last ones stay, the first one, and the one that shows the cause best.
    """
    merged: list[Moment] = []
    for each in sorted(_all(evidence), key=lambda each: each.time_s):
        last = merged[-1] if merged else None
        if last is not None and each.time_s - last.time_s < SAME_S:
            if each.label not in last.label:
                label = f"{last.label}; {each.label}"
                merged[-1] = Moment(time_s=each.time_s, label=label)
        else:
            merged.append(each)
    if len(merged) > MOST:
        shows = telling_moment(evidence, merged)
        latest = [each for each in merged[1:] if each is not shows][2 - MOST :]
        merged = [each for each in merged if each is merged[0] or each is shows or each in latest]
    return tuple(Moment(time_s=m.time_s, label=m.label[:1].upper() + m.label[1:]) for m in merged)


def telling_moment(evidence: Evidence, moments: Sequence[Moment]) -> Moment | None:
    """Return the moment that shows best why a flight ended as it did.

    Of a collision that is when the camera shows the body for the last time, of a touchdown when the
    UAV passes ``COMMIT_M``, and of a flight without a landing when the marker is best to read.
    """
    time_s = _telling_s(evidence)
    if time_s is None:
        return last_far(evidence.flight, moments)
    return min(moments, key=lambda each: abs(each.time_s - time_s), default=None)


def _telling_s(evidence: Evidence) -> float | None:
    """Return when a flight shows best why it ended so; None if nothing was to be seen."""
    flight, end_s = evidence.flight, evidence.decided_s
    if evidence.hit:
        body = evidence.hit.body
        return max(
            (s.time_s for s in flight.steps if body in s.objects_visible and s.time_s <= end_s),
            default=end_s,
        )
    if flight.outcome in ("landed", "slid"):
        low = _descends_below(flight, COMMIT_M, end_s)
        return end_s if low is None else low
    if flight.outcome in NO_LANDING:
        best = _best_to_read(flight, end_s)
        return best.time_s if best else None
    return end_s


def _best_to_read(flight: Flight, end_s: float) -> Step | None:
    """Return the frame in which the marker is best to read; None if it is in no frame."""
    shown = [s for s in flight.steps if s.time_s <= end_s and s.marker_visible > 0]
    return max(
        shown,
        key=lambda s: (round(readable_probability(s.marker), 2), s.marker_visible * s.marker_px),
        default=None,
    )


def last_far(flight: Flight, moments: Sequence[Moment]) -> Moment | None:
    """Return the last moment at which the UAV is not close to the ground; without one the last."""
    heights = flight.uav.position_m[:, 2]
    for moment in reversed(moments):
        if feet_height_m(float(np.interp(moment.time_s, flight.uav.time_s, heights))) >= CLOSE_M:
            return moment
    return moments[-1] if moments else None


def _all(evidence: Evidence) -> Iterator[Moment]:
    flight, end_s = evidence.flight, evidence.decided_s
    readable = [step.time_s for step in evidence.readable_until(end_s)]
    if readable:
        yield Moment(time_s=readable[0], label="the marker can be read for the first time")
        gap = _longest_gap(readable, end_s)
        if gap:
            yield Moment(time_s=gap, label="the marker can be read for the last time before a gap")
    until = [each for each in evidence.reports if each.step.time_s <= end_s]
    reported = [each.step.time_s for each in until if each.marker]
    targeted = [each.step.time_s for each in until if each.target_m]
    elsewhere = [each.step.time_s for each in until if each.elsewhere]
    if reported:
        yield Moment(time_s=reported[0], label="the system reports the marker for the first time")
    elif targeted:
        yield Moment(time_s=targeted[0], label="the system has a target for the first time")
    if elsewhere:
        yield Moment(time_s=elsewhere[0], label="the system reports another place")
    last = evidence.last_report_s(end_s)
    if last is not None and end_s - last > BEFORE_END_S:
        verb = "reports the marker" if evidence.reports_detections else "has its target there"
        yield Moment(time_s=last, label=f"the system {verb} for the last time")
    low = _descends_below(flight, COMMIT_M, end_s)
    if low is not None:
        yield Moment(time_s=low, label=f"the UAV passes {COMMIT_M:g} m")
    if flight.outcome in NO_LANDING and (best := _best_to_read(flight, end_s)):
        yield Moment(time_s=best.time_s, label="the marker is best to read")
    if flight.outcome in NO_LANDING and (lowest := _turns_back(flight, end_s)) is not None:
        yield Moment(time_s=lowest, label="the UAV turns back up")
    if evidence.hit and evidence.hit.body_class == "dynamic":
        yield from _sightings(flight, evidence.hit.body, end_s)
    if end_s > 2 * BEFORE_END_S:
        yield Moment(time_s=end_s - BEFORE_END_S, label=f"{BEFORE_END_S:g} s before the end")
    yield Moment(time_s=end_s, label=_end_label(evidence))
    if flight.elapsed_s - end_s > BEFORE_END_S:
        yield Moment(time_s=flight.elapsed_s, label="the flight ends")


def _sightings(flight: Flight, body: str, end_s: float) -> Iterator[Moment]:
    """Yield when the camera first shows a body, and when it comes into view for the last time."""
    times = [s.time_s for s in flight.steps if body in s.objects_visible and s.time_s <= end_s]
    if not times:
        return
    yield Moment(time_s=times[0], label=f"{body} is in view for the first time")
    if end_s - times[-1] >= SAME_S:
        yield Moment(time_s=times[-1], label=f"{body} is in view for the last time")
    starts = [after for before, after in itertools.pairwise(times) if after - before > 1]
    if starts:
        yield Moment(time_s=starts[-1], label=f"{body} comes into view again")


def _longest_gap(readable: list[float], end_s: float) -> float | None:
    """Return when the marker was last readable before its longest gap, if that is a second."""
    after = [*readable[1:], end_s]
    gaps = [(b - a, a) for a, b in zip(readable, after, strict=True)]
    longest, since = max(gaps)
    return since if longest > 1.0 else None


def _descends_below(flight: Flight, height_m: float, end_s: float) -> float | None:
    """Return when the feet last came below a height, after the UAV had been high."""
    heights = np.array([feet_height_m(float(z)) for z in flight.uav.position_m[:, 2]])
    times = flight.uav.time_s
    high = np.flatnonzero((heights >= height_m) & (times <= end_s))
    if not len(high) or heights[: high[-1] + 1].max() < min(LOW_M, heights.max()):
        return None
    after = int(high[-1]) + 1
    return float(times[after]) if after < len(times) and times[after] <= end_s else None


def _turns_back(flight: Flight, end_s: float) -> float | None:
    """Return when the UAV was lowest after it had come down by a metre, if it rose by a metre."""
    heights, times = flight.uav.position_m[:, 2], flight.uav.time_s
    sunk = np.flatnonzero(np.maximum.accumulate(heights) - heights >= 1.0)
    part = heights[sunk[0] if len(sunk) else len(heights) : np.searchsorted(times, end_s)]
    lowest = int(np.argmin(part)) if len(part) else 0
    if not len(part) or part[lowest:].max() - part[lowest] < 1.0:
        return None
    return float(times[sunk[0] + lowest])


def _end_label(evidence: Evidence) -> str:
    if evidence.hit:
        body = evidence.hit.body
        return f"the UAV hits {'the ground' if body == 'ground' else body}"
    return {
        "landed": "the UAV touches down",
        "slid": "the UAV touches down",
        "gave_up": "the landing system gives up",
        "crashed": "the landing system fails",
    }.get(evidence.flight.outcome, "the flight ends")
