"""Paths: what the system planned, where it took the marker to be, and what the UAV flew."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from foxglove.messages import PoseInFrame, PosesInFrame

from pytest_garl.flight.flight import Flight, Step
from pytest_garl.reports.mcap.values import IDENTITY, WORLD, Logged, ns, pose, stamp

PLAN, TARGET, PATH = "/plan", "/target", "/path"
MOST_POSES = 1000
"""More places than a path of a minute has at the rate of the tracks' samples, about."""
Place = tuple[float, float, float]


def plans(flight: Flight) -> Iterator[Logged]:
    """Yield the system's planned path and its target whenever they change.

    Both are in the world: the error of the system's own position is subtracted, as verdicts do.  An
    empty plan says that the system has none.
    """
    plan: tuple[Place, ...] = ()
    target: Place | None = None
    for step in flight.steps:
        diagnostics, time_ns = step.diagnostics, ns(step.time_s)
        planned = tuple(
            _in_world(step, place) for place in (diagnostics.planned_path_m if diagnostics else ())
        )
        if planned != plan:
            plan = planned
            yield Logged(time_ns=time_ns, topic=PLAN, message=_path(time_ns, plan))
        wanted = diagnostics.target_m if diagnostics else None
        aimed = _in_world(step, wanted) if wanted is not None else None
        if aimed is not None and aimed != target:
            target = aimed
            message = PoseInFrame(timestamp=stamp(time_ns), frame_id=WORLD, pose=pose(target))
            yield Logged(time_ns=time_ns, topic=TARGET, message=message)


def flown_path(flight: Flight) -> Iterator[Logged]:
    """Yield the whole path of the UAV, once."""
    places = flight.uav.position_m
    stride = math.ceil(len(places) / MOST_POSES)
    kept = [(float(x), float(y), float(z)) for x, y, z in places[::stride]]
    yield Logged(time_ns=0, topic=PATH, message=_path(0, kept))


def _path(time_ns: int, places: Sequence[Place]) -> PosesInFrame:
    """Return places as poses whose x axes point along the path."""
    poses, turn = [], IDENTITY
    for index, place in enumerate(places):
        if index + 1 < len(places):
            turn = _along(place, places[index + 1], turn)
        poses.append(pose(place, turn))
    return PosesInFrame(timestamp=stamp(time_ns), frame_id=WORLD, poses=poses)


def _along(
    start: Place, end: Place, otherwise: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Return the quaternion that turns x towards the end, by pitch and then by yaw."""
    dx, dy, dz = (b - a for a, b in zip(start, end, strict=True))
    across = math.hypot(dx, dy)
    if across == 0 and dz == 0:
        return otherwise
    yaw, pitch = math.atan2(dy, dx) / 2, -math.atan2(dz, across) / 2
    return (
        -math.sin(yaw) * math.sin(pitch),
        math.cos(yaw) * math.sin(pitch),
        math.sin(yaw) * math.cos(pitch),
        math.cos(yaw) * math.cos(pitch),
    )


def _in_world(step: Step, place: Place) -> Place:
    x, y, z = (a - b for a, b in zip(place, step.estimation_error_m, strict=True))
    return x, y, z
