"""Margins: how far a flight was from violating each property, in every flight.

All of them are continuous, and a flight that is worse in nothing but one respect has no larger
margin.  In a flight that ended early they are estimates from the path that was flown.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Touchdown
from pytest_garl.flight.thresholds import (
    BODY_ABOVE_FEET_M,
    COMMIT_M,
    HARD_TOUCHDOWN_MPS,
    SLID_M,
    UPRIGHT_RAD,
)
from pytest_garl.verdicts.evidence import Evidence
from pytest_garl.verdicts.findings import UNDETECTED_S
from pytest_garl.verdicts.verdict import NO_LANDING, Margin, MarginName

CONE = 0.25
"""Weight of the height above the commit height against the distance: the slope of an approach."""
DESCENT_MPS = 1.0
"""Speed of a nominal descent, for the time that a flight still needs."""
FARTHEST_M = 10.0
"""Margins of distances to bodies and decoys that are not there."""


def margins(evidence: Evidence, *, violates_time: bool) -> tuple[Margin, ...]:
    """Return the margin of every property.

    ``decided`` is True for a flight that touched down, ran out of time or gave up; the margins of
    distances to bodies are always measured.  ``violates_time`` says whether a landing that was
    given up violates the limit of time: it does unless it is excused.
    """
    flight, limit_m = evidence.flight, evidence.limits.distance_m
    decided = flight.outcome in ("landed", "slid", *NO_LANDING)
    reason = "" if decided else f"the flight ended at {flight.elapsed_s:.1f} s"
    down = flight.outcome == "slid" or evidence.off_marker_m is not None
    low = _low(evidence)
    moving, static = _separation(evidence, "dynamic"), _separation(evidence, "static")

    def margin(
        name: MarginName, value: float, unit: str, *, known: bool = decided, why: str = reason
    ) -> Margin:
        return Margin(
            property=name,
            value=value,
            unit=unit,
            decided=known,
            reason="" if known else why or "the UAV did not come down",
        )

    return (
        margin("distance", limit_m - _distance_m(evidence), "m"),
        margin("time", _time_left_s(evidence, violates_time), "s"),
        margin("collision", min(moving, static), "m", known=True),
        margin("moving", moving, "m", known=True),
        margin("static", static, "m", known=True),
        margin("touchdown_speed", HARD_TOUCHDOWN_MPS - _sink_mps(evidence, low), "m/s", known=down),
        margin("touchdown_tilt", UPRIGHT_RAD - _tilt_rad(evidence, low), "rad", known=down),
        margin("dropout", UNDETECTED_S - evidence.undetected[0], "s", known=True),
        margin("decoy", _decoy_m(evidence), "m", known=True),
        margin(
            "tracking",
            limit_m - _tracking_error_m(evidence, low),
            "m",
            known=bool(evidence.targets) and bool(low.any()),
            why="the system reports no target, or did not come down",
        ),
        margin("slide", SLID_M - _slid_m(evidence), "m", known=down),
        margin("crash", 0.0 if flight.outcome == "crashed" else 1.0, "1", known=True),
    )


def _commit_distance_m(evidence: Evidence, place: tuple[float, float]) -> float:
    """Return how far from a place the flight committed itself to landing.

    That is the least distance after the take-off, plus a share of the height above the commit
    height, so that a flight that stayed high is no nearer than its approach would have been.
    """
    x, y, z = evidence.flight.uav.position_m[_start(evidence) :].T
    above = np.maximum(0.0, z - BODY_ABOVE_FEET_M - COMMIT_M)
    return float((np.hypot(x - place[0], y - place[1]) + CONE * above).min())


def _start(evidence: Evidence) -> int:
    """Return the first sample after the take-off, or the last one of the track."""
    return min(evidence.flying_from, len(evidence.flight.uav.time_s) - 1)


def _low(evidence: Evidence) -> NDArray[np.bool_]:
    """Whether the flight was below the commit height, after its take-off, at each sample."""
    low: NDArray[np.bool_] = evidence.flight.uav.position_m[:, 2] < COMMIT_M + BODY_ABOVE_FEET_M
    low = low.copy()
    low[: _start(evidence)] = False
    return low


def _distance_m(evidence: Evidence) -> float:
    flight, off_m = evidence.flight, evidence.off_marker_m
    if flight.outcome == "slid" and evidence.touchdown_off_marker is None:
        return flight.final_distance_m
    if off_m is not None:
        return off_m
    return _commit_distance_m(evidence, flight.marker_position_m)


def _time_left_s(evidence: Evidence, violates_time: bool) -> float:
    """Return the time that is left; of a flight that ended early, after the descent it needed."""
    flight, limit_s = evidence.flight, evidence.limits.time_s
    if flight.outcome in ("landed", "slid"):
        return limit_s - evidence.landed_s
    left_s = limit_s - flight.elapsed_s
    if flight.outcome in NO_LANDING:
        return min(0.0, left_s) if violates_time else max(0.0, left_s)
    height_m = max(0.0, float(flight.uav.position_m[-1, 2]) - BODY_ABOVE_FEET_M)
    return left_s - height_m / DESCENT_MPS


def _separation(evidence: Evidence, body_class: str) -> float:
    if evidence.hit and evidence.hit.body_class == body_class:
        return 0.0
    gaps = [gap.distance_m for gap in evidence.flight.separations if gap.body_class == body_class]
    return min([FARTHEST_M, *gaps])


def _sink_mps(evidence: Evidence, low: NDArray[np.bool_]) -> float:
    """Return the touchdown's vertical speed, or the fastest sinking below the commit height."""
    flight = evidence.flight
    if flight.touchdown:
        return max(each.speed_mps for each in _last_touchdowns(evidence))
    ground = [each.speed_mps for each in flight.contacts if each.body_class == "ground"]
    sinking = -flight.uav.velocity_mps[low, 2]
    return max([0.0, *ground]) if ground else float(max(0.0, sinking.max(initial=0.0)))


def _tilt_rad(evidence: Evidence, low: NDArray[np.bool_]) -> float:
    flight = evidence.flight
    if flight.touchdown:
        return max(each.tilt_rad for each in _last_touchdowns(evidence))
    x, y = flight.uav.attitude[low, 0], flight.uav.attitude[low, 1]
    tilts = np.arccos(np.clip(1 - 2 * (x * x + y * y), -1.0, 1.0))
    return float(tilts.max(initial=0.0))


def _last_touchdowns(evidence: Evidence) -> tuple[Touchdown, ...]:
    """Return the last touchdown, with those of the same stay on the ground before its hops."""
    stays, last = evidence.stays, evidence.flight.touchdown
    if stays and stays[-1].touchdowns[-1] is last:
        return stays[-1].touchdowns
    return (last,) if last else ()


def _decoy_m(evidence: Evidence) -> float:
    """Return by how much the flight kept nearer to the marker than to a decoy.

    Both by the path that was flown and by each target that the system reported.
    """
    decoys = [(x, y) for _, x, y in evidence.flight.decoys]
    if not decoys:
        return FARTHEST_M
    marker = evidence.flight.marker_position_m
    own = _commit_distance_m(evidence, marker)
    gaps = [_commit_distance_m(evidence, place) - own for place in decoys]
    gaps += [
        math.dist(target, place) - math.dist(target, marker)
        for _, target in evidence.targets
        for place in decoys
    ]
    return min([FARTHEST_M, *gaps])


def _tracking_error_m(evidence: Evidence, low: NDArray[np.bool_]) -> float:
    """Return the largest distance from the reported target below the commit height."""
    track = evidence.flight.uav
    errors = []
    for time_s, target in evidence.targets:
        index = track.index_at(time_s)
        if low[index]:
            errors.append(math.dist(target, tuple(track.position_m[index, :2])))
    return max(errors, default=0.0)


def _slid_m(evidence: Evidence) -> float:
    if evidence.dragged:
        return evidence.dragged.moved_m
    last = evidence.flight.touchdown
    return last.slid_m if last else 0.0
