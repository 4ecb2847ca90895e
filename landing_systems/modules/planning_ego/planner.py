"""The planner that a landing system talks to: goals in, setpoints out, replanning within."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from landing_systems.modules.planning_ego.bspline import UniformSpline
from landing_systems.modules.planning_ego.errors import NoTrajectoryError, PlannerError
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from landing_systems.modules.planning_ego.guides import checked_samples, samples_per_span
from landing_systems.modules.planning_ego.initial import local_target
from landing_systems.modules.planning_ego.parameters import EgoParameters
from landing_systems.modules.planning_ego.trajectory import escape_distance, plan_trajectory
from pytest_garl import Camera, Observation

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
State = Literal["INIT", "WAIT_TARGET", "GEN_NEW_TRAJ", "REPLAN_TRAJ", "EXEC_TRAJ", "EMERGENCY_STOP"]
PATH_STEP_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Setpoint:
    """Wanted position and velocity, and the planner's state.

    ``path_m`` are points of the trajectory still to fly, for ``Diagnostics``.  ``error``
    says why the last planning failed; the setpoint then follows the trajectory that there
    is, or holds.  ``reached`` is true once a trajectory to the goal has been flown to its
    end.
    """

    state: State
    position_m: Vector
    velocity_mps: Vector
    acceleration_mps2: Vector
    path_m: tuple[Vector, ...]
    error: PlannerError | None
    reached: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Flown:
    """A trajectory and when it began."""

    spline: UniformSpline
    began_s: float
    at_goal: bool

    def state(self, time_s: float) -> Array:
        """Position, velocity and acceleration (3, 3); at rest after the end."""
        elapsed = time_s - self.began_s
        state = np.stack([self.spline.evaluate(elapsed, order) for order in range(3)])
        if elapsed >= self.spline.duration_s:
            state[1:] = 0.0
        return state


class EgoPlanner:
    """Ego-Planner for one flight: ``observe`` each frame, ``set_goal``, then ``plan``.

    The grid covers ``map_size_m`` about ``centre_m`` (x, y).
    """

    def __init__(
        self,
        parameters: EgoParameters,
        camera: Camera,
        centre_m: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._p = parameters
        self.grid = OccupancyGrid(parameters, camera, centre_m)
        self._state: State = "INIT"
        self._goal: Array | None = None
        self._origin: Array | None = None
        self._reached = False
        self._flown: _Flown | None = None
        self._hold: Array | None = None
        self._error: PlannerError | None = None
        self.replans = 0
        """How often a trajectory has been planned or tried to be, for benchmarks."""

    def observe(self, observation: Observation) -> None:
        """Enter a frame's depth image into the grid."""
        self.grid.observe(
            observation.time_s,
            observation.position_m,
            observation.attitude,
            observation.depth_m,
        )

    def set_goal(self, goal_m: Vector) -> None:
        """Say where to fly; a goal within ``goal_change_m`` of the present one is the same.

        Raises ValueError if the goal is not finite.
        """
        goal = np.array(goal_m, float)
        if not np.isfinite(goal).all():
            raise ValueError(f"the goal is {goal_m}; expected three finite numbers")
        if self._goal is not None and np.linalg.norm(goal - self._goal) < self._p.goal_change_m:
            return
        self._goal, self._origin, self._reached = goal, None, False
        if self._state == "EXEC_TRAJ":
            self._state = "REPLAN_TRAJ"

    def plan(self, time_s: float, position_m: ArrayLike, velocity_mps: ArrayLike) -> Setpoint:
        """Return the setpoint for a UAV at ``position_m`` (3,) with ``velocity_mps`` (3,).

        Planning that fails raises nothing: the setpoint's ``error`` tells.
        """
        position, velocity = np.array(position_m, float), np.array(velocity_mps, float)
        self._error = None
        if self._hold is None:
            self._hold = position
        if self._state == "INIT":
            self._state = "WAIT_TARGET"
        if self._state == "WAIT_TARGET" and self._goal is not None and not self._reached:
            self._state, self._hold = "GEN_NEW_TRAJ", position
        if (
            self._state == "EMERGENCY_STOP"
            and np.linalg.norm(velocity) < self._p.emergency_exit_speed_mps
        ):
            self._state = "GEN_NEW_TRAJ"
        if self._flown is not None:
            self._follow(self._flown, time_s, position)
        if self._state == "GEN_NEW_TRAJ":
            self._try(time_s, position, np.stack([position, velocity, np.zeros(3)]))
        elif self._state == "REPLAN_TRAJ" and self._flown is not None:
            self._try(time_s, position, self._flown.state(time_s))
        if self._flown is not None:
            self._keep_safe(self._flown, time_s, position)
        return self._setpoint(time_s)

    def _follow(self, flown: _Flown, time_s: float, position: Array) -> None:
        """Decide whether the trajectory is flown to its end, goes on, or is planned again."""
        p, here = self._p, flown.state(time_s)[0]
        if np.linalg.norm(position - here) > p.max_deviation_m:
            self._hold, self._flown = position, None
            self._state = "GEN_NEW_TRAJ"
        elif time_s - flown.began_s >= flown.spline.duration_s:
            self._hold, self._flown = here, None
            self._reached = flown.at_goal and self._state == "EXEC_TRAJ"
            self._state = "WAIT_TARGET" if self._reached else "GEN_NEW_TRAJ"
        elif self._state == "EXEC_TRAJ" and self._goal is not None:
            start = flown.spline.evaluate(0.0)
            near = np.linalg.norm(self._goal - position) < p.no_replan_distance_m
            if not (near and flown.at_goal) and np.linalg.norm(here - start) >= p.replan_distance_m:
                self._state = "REPLAN_TRAJ"

    def _try(self, time_s: float, position: Array, start: Array) -> bool:
        """Plan from a state (3, 3) to the local target; whether that led to a trajectory."""
        if self._goal is None:
            return False
        path = None
        if self._origin is None:
            self._origin = position
        elif self._flown is not None:
            path = self._rest(self._flown, time_s)
        target, target_velocity, at_goal = local_target(
            start[0], self._origin, self._goal, self.grid, self._p
        )
        end = np.stack([target, target_velocity, np.zeros(3)])
        if path is not None:
            path = np.concatenate([path, target[None]])
        self.replans += 1
        try:
            spline = plan_trajectory(
                self.grid, self._p, start=start, end=end, at_goal=at_goal, path=path
            )
        except PlannerError as error:
            self._error = error
            return False
        self._flown = _Flown(spline=spline, began_s=time_s, at_goal=at_goal)
        self._state = "EXEC_TRAJ"
        return True

    def _rest(self, flown: _Flown, time_s: float) -> Array:
        """Return the points (n, 3) of a trajectory still to fly, one per knot, n >= 2."""
        elapsed, duration = time_s - flown.began_s, flown.spline.duration_s
        count = max(2, round((duration - elapsed) / flown.spline.span_s) + 1)
        return flown.spline.evaluate(np.linspace(elapsed, duration, count))

    def _keep_safe(self, flown: _Flown, time_s: float, position: Array) -> None:
        """Plan again if the trajectory runs into something; stop if that is near and fails."""
        ahead_s = self._collision_in(flown, time_s)
        if ahead_s is None:
            return
        if flown.began_s == time_s or self._error is not None:
            failed = True
        else:
            failed = not self._try(time_s, position, flown.state(time_s))
        if failed and ahead_s < self._p.emergency_time_s:
            self._state, self._flown, self._hold = "EMERGENCY_STOP", None, position
        elif failed:
            self._state = "REPLAN_TRAJ"

    def _collision_in(self, flown: _Flown, time_s: float) -> float | None:
        """Return the time in which the checked part of a trajectory collides, or None."""
        p, spline = self._p, flown.spline
        elapsed = time_s - flown.began_s
        # The places that the optimisation has checked, so that both agree.
        count, per_span = len(spline.points), samples_per_span(p)
        step = spline.span_s / per_span
        whole = flown.at_goal or elapsed >= p.checked_share * spline.duration_s
        last = checked_samples(count, per_span, 1.0 if whole else p.checked_share)
        moments = np.arange(math.ceil(elapsed / step), last) * step
        points = spline.evaluate(moments)
        hits = self.grid.occupied(points)
        if not hits.any():
            return None
        here = spline.evaluate(elapsed)
        try:
            lowest = min(p.min_height_m, float(here[2]))
            escape_m, _ = escape_distance(self.grid, here, lowest, p)
        except NoTrajectoryError:
            return 0.0
        hits &= np.linalg.norm(points - here, axis=1) > escape_m
        return float(moments[hits.argmax()] - elapsed) if hits.any() else None

    def _setpoint(self, time_s: float) -> Setpoint:
        rest = np.zeros((3, 3))
        path = np.zeros((0, 3))
        if self._hold is not None:
            rest[0] = self._hold
        if self._flown is not None:
            rest = self._flown.state(time_s + self._p.lookahead_s)
            spline, elapsed = self._flown.spline, time_s - self._flown.began_s
            moments = np.arange(elapsed, spline.duration_s, PATH_STEP_S)
            path = spline.evaluate(np.append(moments, spline.duration_s))
        return Setpoint(
            state=self._state,
            position_m=_vector(rest[0]),
            velocity_mps=_vector(rest[1]),
            acceleration_mps2=_vector(rest[2]),
            path_m=tuple(_vector(point) for point in path),
            error=self._error,
            reached=self._reached,
        )


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
