"""Margins: how far a flight was from violating each property, in every flight.

All of them are continuous, and a flight that is worse in nothing but one respect has no larger
margin.  In a flight that ended early they are estimates from the path that was flown.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, Touchdown
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, HARD_TOUCHDOWN_MPS, SLID_M, UPRIGHT_RAD
from pytest_garl.verdicts.findings import UNDETECTED_S, undetected_s
from pytest_garl.verdicts.phases import flying_from
from pytest_garl.verdicts.sightings import target_of
from pytest_garl.verdicts.touchdowns import Stay, dragged, landed_s, stays, touchdown_off_marker
from pytest_garl.verdicts.verdict import Limits, Margin, MarginName

COMMIT_M = 2.0
"""Height of the feet below which a landing cannot see the whole marker, and commits itself."""
CONE = 0.25
"""Weight of the height above the commit height against the distance: the slope of an approach."""
DESCENT_MPS = 1.0
"""Speed of a nominal descent, for the time that a flight still needs."""
FARTHEST_M = 10.0
"""Margins of distances to bodies and decoys that are not there."""


def margins(flight: Flight, limits: Limits, *, violates_time: bool) -> tuple[Margin, ...]:
    """Return the margin of every property.

    ``decided`` is True for a flight that touched down, ran out of time or gave up; the margins of
    distances to bodies are always measured.  ``violates_time`` says whether a landing that was
    given up violates the limit of time: it does unless it is excused.
    """
    decided = flight.outcome in ("landed", "slid", "gave_up", "not_landed")
    reason = "" if decided else f"the flight ended at {flight.elapsed_s:.1f} s"
    stay = dragged(flight, limits)
    came_down = stay is not None or touchdown_off_marker(flight, limits) is not None
    down = flight.outcome in ("landed", "slid") or came_down
    low = _low(flight)
    moving, static = _separation(flight, "dynamic"), _separation(flight, "static")
    reported = any(target_of(step) for step in flight.steps)

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
        margin("distance", limits.distance_m - _distance_m(flight, limits), "m"),
        margin("time", _time_left_s(flight, limits, violates_time), "s"),
        margin("collision", min(moving, static), "m", known=True),
        margin("moving", moving, "m", known=True),
        margin("static", static, "m", known=True),
        margin("touchdown_speed", HARD_TOUCHDOWN_MPS - _sink_mps(flight, low), "m/s", known=down),
        margin("touchdown_tilt", UPRIGHT_RAD - _tilt_rad(flight, low), "rad", known=down),
        margin("dropout", UNDETECTED_S - undetected_s(flight)[0], "s", known=True),
        margin("decoy", _decoy_m(flight), "m", known=True),
        margin(
            "tracking",
            limits.distance_m - _tracking_error_m(flight),
            "m",
            known=reported and bool(low.any()),
            why="the system reports no target, or did not come down",
        ),
        margin("slide", SLID_M - _slid_m(flight, stay), "m", known=down),
        margin("crash", 0.0 if flight.outcome == "crashed" else 1.0, "1", known=True),
    )


def commit_distance_m(flight: Flight, place: tuple[float, float]) -> float:
    """Return how far from a place the flight committed itself to landing.

    That is the least distance after the take-off, plus a share of the height above the commit
    height, so that a flight that stayed high is no nearer than its approach would have been.
    """
    x, y, z = _after_take_off(flight).T
    above = np.maximum(0.0, z - BODY_ABOVE_FEET_M - COMMIT_M)
    return float((np.hypot(x - place[0], y - place[1]) + CONE * above).min())


def _after_take_off(flight: Flight) -> NDArray[np.float64]:
    """Return the positions (n, 3) from the end of the take-off on, or the last one."""
    places = flight.uav.position_m
    return places[_start(flight) :]


def _start(flight: Flight) -> int:
    return min(flying_from(flight), len(flight.uav.time_s) - 1)


def _low(flight: Flight) -> NDArray[np.bool_]:
    """Whether the flight was below the commit height, after its take-off, at each sample."""
    low: NDArray[np.bool_] = flight.uav.position_m[:, 2] < COMMIT_M + BODY_ABOVE_FEET_M
    low = low.copy()
    low[: _start(flight)] = False
    return low


def _distance_m(flight: Flight, limits: Limits) -> float:
    touchdown = touchdown_off_marker(flight, limits)
    if touchdown is not None:
        return touchdown.distance_m
    stay = dragged(flight, limits)
    if flight.outcome == "slid" or (flight.outcome == "landed" and stay is None):
        return flight.final_distance_m
    if stay is not None:
        return stay.farthest_m
    return commit_distance_m(flight, flight.marker_position_m)


def _time_left_s(flight: Flight, limits: Limits, violates_time: bool) -> float:
    """Return the time that is left; of a flight that ended early, after the descent it needed."""
    if flight.outcome in ("landed", "slid"):
        return limits.time_s - landed_s(flight)
    if flight.outcome in ("gave_up", "not_landed"):
        left_s = limits.time_s - flight.elapsed_s
        return min(0.0, left_s) if violates_time else max(0.0, left_s)
    height_m = max(0.0, float(flight.uav.position_m[-1, 2]) - BODY_ABOVE_FEET_M)
    return limits.time_s - flight.elapsed_s - height_m / DESCENT_MPS


def _separation(flight: Flight, body_class: str) -> float:
    hit = flight.outcome == "collision" and flight.contacts[-1].body_class == body_class
    if hit:
        return 0.0
    gaps = [gap.distance_m for gap in flight.separations if gap.body_class == body_class]
    return min([FARTHEST_M, *gaps])


def _sink_mps(flight: Flight, low: NDArray[np.bool_]) -> float:
    """Return the touchdown's vertical speed, or the fastest sinking below the commit height."""
    if flight.touchdown:
        return max(each.speed_mps for each in _last_touchdowns(flight))
    ground = [each.speed_mps for each in flight.contacts if each.body_class == "ground"]
    sinking = -flight.uav.velocity_mps[low, 2]
    return max([0.0, *ground]) if ground else float(max(0.0, sinking.max(initial=0.0)))


def _tilt_rad(flight: Flight, low: NDArray[np.bool_]) -> float:
    if flight.touchdown:
        return max(each.tilt_rad for each in _last_touchdowns(flight))
    x, y = flight.uav.attitude[low, 0], flight.uav.attitude[low, 1]
    tilts = np.arccos(np.clip(1 - 2 * (x * x + y * y), -1.0, 1.0))
    return float(tilts.max(initial=0.0))


def _last_touchdowns(flight: Flight) -> tuple[Touchdown, ...]:
    """Return the last touchdown, with those of the same stay on the ground before its hops."""
    found = stays(flight)
    if found and found[-1].touchdowns[-1] is flight.touchdown:
        return found[-1].touchdowns
    return (flight.touchdown,) if flight.touchdown else ()


def _decoy_m(flight: Flight) -> float:
    """Return by how much the flight kept nearer to the marker than to a decoy.

    Both by the path that was flown and by each target that the system reported.
    """
    decoys = [(x, y) for _, x, y in flight.decoys]
    if not decoys:
        return FARTHEST_M
    marker = flight.marker_position_m
    own = commit_distance_m(flight, marker)
    gaps = [commit_distance_m(flight, place) - own for place in decoys]
    targets = [target for step in flight.steps if (target := target_of(step))]
    gaps += [
        math.dist(target, place) - math.dist(target, marker)
        for target in targets
        for place in decoys
    ]
    return min([FARTHEST_M, *gaps])


def _tracking_error_m(flight: Flight) -> float:
    """Return the largest distance from the reported target below the commit height."""
    times, places = flight.uav.time_s, flight.uav.position_m
    low = _low(flight)
    errors = []
    for step in flight.steps:
        index = max(0, int(np.searchsorted(times, step.time_s, side="right")) - 1)
        target = target_of(step)
        if target is not None and low[index]:
            errors.append(math.dist(target, tuple(places[index, :2])))
    return max(errors, default=0.0)


def _slid_m(flight: Flight, stay: Stay | None) -> float:
    if stay is not None:
        return stay.moved_m
    return flight.touchdown.slid_m if flight.touchdown else 0.0
