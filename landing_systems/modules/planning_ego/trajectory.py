"""One planning: from a state to a target, several attempts, and the errors they end in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.bspline import UniformSpline
from landing_systems.modules.planning_ego.errors import GoalInObstacleError, NoTrajectoryError
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from landing_systems.modules.planning_ego.guides import CollisionSearch
from landing_systems.modules.planning_ego.initial import initial_spline, sideways
from landing_systems.modules.planning_ego.optimise import Task, optimise
from landing_systems.modules.planning_ego.parameters import EgoParameters

Array = NDArray[np.float64]
ESCAPE_M = 1.5
"""A UAV that is within an obstacle's inflation looks so far around for a free place."""


def escape_distance(
    grid: OccupancyGrid, place: Array, lowest_m: float, parameters: EgoParameters
) -> tuple[float, Array | None]:
    """Return how far around a place (3,) occupancy does not count, and the free place to leave to.

    That is 0 and None where the place is free; else the nearest free cell decides.  Raises
    NoTrajectoryError if no cell near by is free.
    """
    if not grid.occupied(place[None])[0]:
        return 0.0, None
    free = grid.nearest_free(place, ESCAPE_M, min(lowest_m, float(place[2])))
    if free is None:
        raise NoTrajectoryError(
            f"({place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f}) m is within an inflated obstacle "
            f"and no place within {ESCAPE_M} m of it is free"
        )
    return float(np.linalg.norm(free - place)) + parameters.resolution_m, free


def plan_trajectory(
    grid: OccupancyGrid,
    parameters: EgoParameters,
    *,
    start: Array,
    end: Array,
    at_goal: bool,
    path: Array | None = None,
) -> UniformSpline:
    """Return a trajectory between two states (3, 3: position, velocity, acceleration).

    ``path`` (n, 3) is tried first, if given; then the straight way, then detours.
    ``at_goal`` says that ``end`` is the goal, so that the whole trajectory must be free.
    Raises GoalInObstacleError if the end is within an obstacle, NoTrajectoryError if no
    attempt succeeds.
    """
    p = parameters
    if grid.occupied(end[:1])[0]:
        x, y, z = end[0]
        raise GoalInObstacleError(
            f"{'the goal' if at_goal else 'the local target'} at ({x:.2f}, {y:.2f}, {z:.2f}) m is "
            "within an inflated obstacle; planning is skipped until it moves or is clear"
        )
    lowest = min(p.min_height_m, float(start[0, 2]), float(end[0, 2]))
    escape_m, exit_m = escape_distance(grid, start[0], lowest, p)
    first = start[:1] if exit_m is None else np.stack([start[0], exit_m])
    paths = [] if path is None else [path]
    paths.append(np.concatenate([first, end[:1]]))
    detours = range(1, p.init_tries + 1)
    paths += [np.stack([*first, sideways(first[-1], end[0], n), end[0]]) for n in detours]
    for attempt in paths[: p.init_tries]:
        initial = initial_spline(attempt, start, end, p)
        search = CollisionSearch(
            grid,
            p,
            len(initial.points),
            checked_share=1.0 if at_goal else p.checked_share,
            lowest_m=lowest,
            escape_m=escape_m,
        )
        task = Task(initial=initial, start=start, end=end, search=search, lowest_m=lowest)
        trajectory = optimise(task, p)
        if trajectory is not None:
            return trajectory
    raise NoTrajectoryError(
        f"none of {p.init_tries} initial paths led around the obstacles from "
        f"({start[0, 0]:.2f}, {start[0, 1]:.2f}, {start[0, 2]:.2f}) to "
        f"({end[0, 0]:.2f}, {end[0, 1]:.2f}, {end[0, 2]:.2f}) m"
    )
