"""Initial trajectory before the optimisation: its path, its timing, its end."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.bspline import UniformSpline, fit
from landing_systems.modules.planning_ego.costs import speed_scale
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from landing_systems.modules.planning_ego.parameters import EgoParameters

Array = NDArray[np.float64]
_SHORTEST_S = 0.1
"""No trajectory is shorter: one frame of the camera."""


def local_target(
    position: Array,
    origin: Array,
    goal: Array,
    grid: OccupancyGrid,
    parameters: EgoParameters,
) -> tuple[Array, Array, bool]:
    """Return the place (3,) and velocity (3,) to plan to, and whether that is the goal.

    It lies on the straight line from ``origin`` to ``goal``, one horizon away; within an
    obstacle it moves along the line by ``target_shift_m`` at most, onwards rather than
    back.  The velocity lets the UAV brake before the goal.
    """
    p = parameters
    way = goal - origin
    length = float(np.linalg.norm(way))
    if np.linalg.norm(goal - position) <= p.planning_horizon_m or length == 0:
        return goal, np.zeros(3), True
    direction = way / length
    along = float((position - origin) @ direction)
    aside = float(np.linalg.norm(position - origin - along * direction))
    # Off the line by more than the horizon, aim for its nearest point, a little onwards.
    ahead = math.sqrt(max(p.planning_horizon_m**2 - aside**2, (p.planning_horizon_m / 2) ** 2))
    reached = min(length, max(0.0, along) + ahead)
    shifts = np.arange(0.0, p.target_shift_m + 1e-9, p.resolution_m)
    places = np.concatenate([reached + shifts, reached - shifts])
    places = places[(places > along) & (places <= length)]
    points = origin + places[:, None] * direction
    free = np.flatnonzero(~grid.occupied(points))
    if len(free):
        reached = float(places[free[0]])
    target = origin + reached * direction
    limit = _along(direction, p) / p.time_factor
    speed = min(limit, math.sqrt(2 * p.max_acc_mps2 * (length - reached)))
    return target, speed * direction, reached == length


def initial_spline(
    path: Array, start: Array, end: Array, parameters: EgoParameters
) -> UniformSpline:
    """Return a spline along a path (n, 3), timed to start and end with the given states.

    The speed rises and falls at the limit of acceleration, up to the speed limit over
    ``time_factor``.  ``start`` and ``end`` (3, 3) are position, velocity, acceleration.
    """
    p = parameters
    # Where the vertical limit is lower, heights count for more.
    legs = np.linalg.norm(np.diff(path, axis=0) * speed_scale(p), axis=1)
    marks = np.concatenate([[0.0], np.cumsum(legs)])
    length = float(marks[-1])
    outset = (path[1] - path[0]) / max(float(np.linalg.norm(path[1] - path[0])), 1e-9)
    v0, v1 = max(0.0, float(start[1] @ outset)), float(np.linalg.norm(end[1]))
    lengths, times = _profile(length, v0, v1, p)
    # Turning round takes time however short the way is.
    turn = float(np.linalg.norm(end[1] - start[1])) / p.max_acc_mps2
    duration = max(float(times[-1]), turn, _SHORTEST_S)
    times *= duration / max(float(times[-1]), 1e-9)
    span = p.time_factor * p.control_point_distance_m / p.max_vel_mps
    count = max(p.min_samples, math.ceil(duration / span) + 1)
    moments = np.linspace(0.0, duration, count)
    reached = np.interp(moments, times, lengths)
    samples = np.stack([np.interp(reached, marks, path[:, axis]) for axis in range(3)], axis=1)
    return fit(samples, start, end, duration / (count - 1))


def sideways(start: Array, end: Array, attempt: int) -> Array:
    """Return a point beside the middle of the way, on another side at each attempt.

    The sides are left, right and above, half of the way's length off it; upstream draws
    them at random.
    """
    way = end - start
    length = float(np.linalg.norm(way))
    level = np.array([-way[1], way[0], 0.0])
    if np.linalg.norm(level) < 1e-6:
        level = np.array([0.0, 1.0, 0.0])
    level /= np.linalg.norm(level)
    side = (level, -level, np.array([0.0, 0.0, 1.0]))[(attempt - 1) % 3]
    return np.asarray((start + end) / 2 + side * length / 2)


def _along(direction: Array, parameters: EgoParameters) -> float:
    """Top speed in a direction (3,) of unit length."""
    return parameters.max_vel_mps / float(np.linalg.norm(direction * speed_scale(parameters)))


def _profile(length: float, v0: float, v1: float, p: EgoParameters) -> tuple[Array, Array]:
    """Return lengths and times of a trapezoidal speed profile, finely sampled."""
    top, acc = p.max_vel_mps / p.time_factor, p.max_acc_mps2
    v0, v1 = min(v0, top), min(v1, top)
    peak = min(top, math.sqrt(acc * length + (v0**2 + v1**2) / 2))
    peak = max(peak, v0, v1)
    rise, fall = (peak**2 - v0**2) / (2 * acc), (peak**2 - v1**2) / (2 * acc)
    reached = np.linspace(0.0, length, 65)
    speeds = np.full(65, peak)
    if rise > 0:
        speeds = np.minimum(speeds, np.sqrt(v0**2 + 2 * acc * reached))
    if fall > 0:
        speeds = np.minimum(speeds, np.sqrt(v1**2 + 2 * acc * (length - reached)))
    # Between two samples the square of the speed is linear: time is length over mean speed.
    means = np.maximum((speeds[1:] + speeds[:-1]) / 2, 1e-3)
    times = np.concatenate([[0.0], np.cumsum(np.diff(reached) / means)])
    return reached, times
