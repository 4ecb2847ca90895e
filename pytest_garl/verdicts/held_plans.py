"""The plans of a UAV that holds its place, against the bodies that were there.

A plan is the path that the landing system reports with a frame, in the world; from an end below the
commit height a landing goes on straight down, and so does the plan.  It leads through a body if the
UAV on it would touch the body where that stands at this moment.  That counts once it lasts: half a
second long, of a body that the camera has shown for a third of a second before, in each frame.  So
who crosses the path in a moment, or has just come into view, counts as little as noise.  Where
somebody will be in some seconds, nobody knows: a plan through the place that a walker is about to
leave counts as well.

Bodies are persons, dogs and birds.  A flight's record has no trees and walls.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import Flight, ObjectRecord, Step
from pytest_garl.flight.thresholds import BODY_ABOVE_FEET_M, COMMIT_M
from pytest_garl.scenarios.bodies import Part, rotate
from pytest_garl.scenarios.object_types import OBJECT_TYPES

Array = NDArray[np.float64]
LASTS_S = 0.5
"""What holds for this long is no noise: the time in which the slowest NPC policy decides once."""
KNOWN_S = 0.3
"""A body that was in view for this long could be known: three frames at the default rate."""
UAV_RADIUS_M = 0.5
"""Half of the default airframe's width; below and above its middle it reaches as far as its feet.
"""
SPACING_M = 0.1
"""Distance of the points at which a path is compared with bodies: less than a dog's leg is long."""
SEEN_WITHIN_M = 0.3
"""A reported obstacle so near to a body is that body: a cell of 0.25 m, its corner included."""
REPORT_S = 1.0
"""A report of obstacles counts for this long: a dog at a trot moves by its own length meanwhile."""
NO_BODY_M = 10.0
"""The separation of plans from bodies that are not there, or are farther away."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Through:
    """Plans through a body: from when to when, and for how long it had been in view before.

    ``seen`` says whether the system reported an obstacle there, None if it reports none at all.
    """

    item: ObjectRecord
    since_s: float
    until_s: float
    in_view_s: float
    seen: bool | None


@dataclass(frozen=True, eq=False)
class Plans:
    """The plans in the frames of a flight; ``steps`` are those until the system gave up."""

    flight: Flight
    steps: tuple[Step, ...]

    @cached_property
    def times_s(self) -> Array:
        """The times of the frames (n,)."""
        return np.array([step.time_s for step in self.steps])

    @cached_property
    def planned(self) -> NDArray[np.bool_]:
        """Whether the system reports a plan with each frame (n,)."""
        paths = (step.diagnostics and step.diagnostics.planned_path_m for step in self.steps)
        return np.array([bool(path) for path in paths], np.bool_)

    @cached_property
    def last_reach_m(self) -> Array:
        """How far from the UAV the last plan ended up to each frame (n,); 0 before the first."""
        uav, reaches, reach_m = self.flight.uav, [], 0.0
        for step in self.steps:
            if step.diagnostics and step.diagnostics.planned_path_m:
                end = np.array(step.diagnostics.planned_path_m[-1]) - step.estimation_error_m
                reach_m = float(np.linalg.norm(end - uav.position_m[uav.index_at(step.time_s)]))
            reaches.append(reach_m)
        return np.array(reaches)

    @cached_property
    def separation_m(self) -> float:
        """The least distance within which a plan stayed of a body for long enough to count.

        0 if it led through the body; bodies that could not be known do not count.
        """
        windows = [
            float(np.max(gaps))
            for item in self.flight.objects
            for gaps in windows_of(self.times_s, self._known_gaps_m(item), LASTS_S)
        ]
        return min([NO_BODY_M, *windows])

    @cached_property
    def through(self) -> tuple[Through, ...]:
        """The bodies through which plans led for long enough, in the order of time."""
        found = []
        for item in self.flight.objects:
            hits = self._known_gaps_m(item) <= 0.0
            span = first_span(self.times_s, hits, LASTS_S)
            if span is not None:
                since_s, until_s = span
                found.append(
                    Through(
                        item=item,
                        since_s=since_s,
                        until_s=until_s,
                        in_view_s=float(
                            self._in_view_s(item.name)[self.times_s.tolist().index(since_s)]
                        ),
                        seen=self._was_reported(item, since_s, until_s),
                    )
                )
        return tuple(sorted(found, key=lambda each: (each.since_s, each.item.name)))

    def _known_gaps_m(self, item: ObjectRecord) -> Array:
        """Return the distance of each plan from a body (n,); infinite if it could not be known."""
        return np.where(self._in_view_s(item.name) >= KNOWN_S, self._gaps_m(item), np.inf)

    def _in_view_s(self, name: str) -> Array:
        """Return for how long all frames up to each one have shown a body (n,)."""
        lasted, since_s = [], None
        for step in self.steps:
            if name not in step.objects_visible:
                since_s = None
            elif since_s is None:
                since_s = step.time_s
            lasted.append(0.0 if since_s is None else step.time_s - since_s)
        return np.array(lasted)

    def _gaps_m(self, item: ObjectRecord) -> Array:
        """Return the distance of each plan from a body (n,), infinite without a plan."""
        gaps = np.full(len(self.steps), np.inf)
        for part in OBJECT_TYPES[item.type].parts if item.type in OBJECT_TYPES else ():
            apart = part_offsets(part, self._points, *self._poses(item))
            beside = np.maximum(np.hypot(apart[:, 0], apart[:, 1]) - UAV_RADIUS_M, 0.0)
            above = np.maximum(np.abs(apart[:, 2]) - BODY_ABOVE_FEET_M, 0.0)
            np.minimum.at(gaps, self._frames, np.hypot(beside, above))
        return gaps

    @cached_property
    def _paths(self) -> tuple[tuple[int, Array], ...]:
        """The frames that have a plan, by their numbers, with its points (k, 3) in the world."""
        paths = []
        for number, step in enumerate(self.steps):
            if step.diagnostics and step.diagnostics.planned_path_m:
                path = np.array(step.diagnostics.planned_path_m) - step.estimation_error_m
                paths.append((number, _dense(_to_ground(path))))
        return tuple(paths)

    @cached_property
    def _points(self) -> Array:
        """The points (m, 3) of all plans."""
        return np.concatenate([np.zeros((0, 3)), *(points for _, points in self._paths)])

    @cached_property
    def _frames(self) -> NDArray[np.intp]:
        """The number of the frame of each point (m,)."""
        numbers = [np.full(len(points), number) for number, points in self._paths]
        return np.concatenate([np.zeros(0, np.intp), *numbers]).astype(np.intp)

    def _poses(self, item: ObjectRecord) -> tuple[Array, Array]:
        """Return place (m, 3) and yaw (m,) of a body for each point of the plans."""
        places, yaws = poses_at(item, self.times_s)
        return places[self._frames], yaws[self._frames]

    def _was_reported(self, item: ObjectRecord, since_s: float, until_s: float) -> bool | None:
        """Whether an obstacle was reported within a body in a span of time, None without reports.

        The last report before the span counts as well.
        """
        reports = [
            (step, step.diagnostics.obstacles_m)
            for step in self.steps
            if since_s - REPORT_S <= step.time_s <= until_s
            and step.diagnostics
            and step.diagnostics.obstacles_m is not None
        ]
        for step, obstacles in reports:
            if not obstacles:
                continue
            points = np.array(obstacles) - step.estimation_error_m
            place, yaw = poses_at(item, np.full(len(points), step.time_s))
            for part in OBJECT_TYPES[item.type].parts:
                apart = part_offsets(part, points, place, yaw)
                if float(np.linalg.norm(apart, axis=1).min()) <= SEEN_WITHIN_M:
                    return True
        return False if reports else None


def poses_at(item: ObjectRecord, times_s: Array) -> tuple[Array, Array]:
    """Return place (n, 3) and yaw (n,) of a body at some times."""
    track = item.track
    index = np.maximum(0, np.searchsorted(track.time_s, times_s, side="right") - 1)
    _, _, z, w = track.attitude[index].T
    return track.position_m[index], 2 * np.arctan2(z, w)


def part_offsets(part: Part, points_m: Array, place_m: Array, yaw_rad: Array) -> Array:
    """Return the offset (n, 3) of each point (n, 3) from the nearest place of a part of a body.

    It is in the body's frame, and zero within the part; ``place_m`` (n, 3) and ``yaw_rad`` (n,) are
    the body's.  The nearest place of an ellipsoid is that on the ray to its middle.
    """
    apart = points_m - place_m
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turned = np.stack(
        [
            cos * apart[:, 0] + sin * apart[:, 1],
            cos * apart[:, 1] - sin * apart[:, 0],
            apart[:, 2],
        ],
        axis=1,
    )
    axes = np.array([rotate(part.rotation, unit) for unit in _UNITS])
    own = (turned - np.array(part.position_m)) @ axes.T
    half = np.array(part.size_m) / 2
    if part.shape in ("sphere", "ellipsoid"):
        reach = np.linalg.norm(own / half, axis=1, keepdims=True)
        nearest = own / np.maximum(reach, 1.0)
    else:
        nearest = np.clip(own, -half, half)
        if part.shape == "cylinder":
            across = np.hypot(own[:, 0], own[:, 1])
            share = np.minimum(1.0, half[0] / np.maximum(across, 1e-9))
            nearest[:, :2] = own[:, :2] * share[:, None]
    return np.asarray((own - nearest) @ axes)


_UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _to_ground(path: Array) -> Array:
    """Return a path (k, 3), and the way straight down from an end below the commit height."""
    if path[-1, 2] > COMMIT_M + BODY_ABOVE_FEET_M:
        return path
    x, y, z = path[-1]
    return np.concatenate([path, [[x, y, min(z, BODY_ABOVE_FEET_M)]]])


def _dense(path: Array) -> Array:
    """Return points of a path (k, 3) that are ``SPACING_M`` apart at most."""
    if len(path) < 2:
        return path
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    wanted = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / SPACING_M) + 1))
    # The path's own points stay, so that no corner is cut.
    wanted = np.union1d(wanted, along)
    return np.stack([np.interp(wanted, along, path[:, axis]) for axis in range(3)], axis=1)


def first_span(
    times_s: Array, holds: NDArray[np.bool_], least_s: float
) -> tuple[float, float] | None:
    """Return begin and end of the first span of frames in which something holds for long enough."""
    since: float | None = None
    until = 0.0
    for time_s, here in zip([*times_s.tolist(), math.inf], [*holds.tolist(), False], strict=True):
        if here:
            since, until = (time_s if since is None else since), time_s
            continue
        if since is not None and until - since >= least_s - _ROUNDING_S:
            return since, until
        since = None
    return None


def windows_of(times_s: Array, values: Array, lasts_s: float) -> Sequence[Array]:
    """Return the values in each shortest run of frames that lasts for some time."""
    ends = np.searchsorted(times_s, times_s + lasts_s - _ROUNDING_S)
    return [
        values[begin : end + 1] for begin, end in enumerate(ends.tolist()) if end < len(times_s)
    ]


_ROUNDING_S = 1e-6
