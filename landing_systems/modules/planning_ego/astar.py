"""A* on the inflated grid: its path guides the trajectory to one side of an obstacle."""

from __future__ import annotations

import heapq
import itertools
import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.grid import OccupancyGrid

Array = NDArray[np.float64]


def find_guide(
    grid: OccupancyGrid,
    start_m: Array,
    goal_m: Array,
    *,
    lowest_m: float,
    step: int,
    weight: float,
    max_nodes: int,
) -> Array | None:
    """Return the centres (n, 3) of free cells from start to goal, or None.

    Each cell has 26 neighbours, which are ``step`` cells away with only free cells in between.
    Lengths and the heuristic are Euclidean.  The heuristic is multiplied by ``weight``, so a path
    is at most ``weight`` times as long as the shortest one.  No cell lies below the lowest
    of ``lowest_m``, the start and the goal.  The result is also None if start or goal are
    occupied, or once ``max_nodes`` cells have been expanded.  Ties go to the smaller index, so
    that equal grids give equal paths.
    """
    start, goal = (int(cell) for cell in grid.index(np.stack([start_m, goal_m])))
    occupied = grid.occupancy.data
    if occupied[start] or occupied[goal]:
        return None
    x_stride, y_stride = (int(stride) for stride in grid.strides[:2])
    floor = int(grid.index(np.array([[start_m[0], start_m[1], lowest_m]]))[0]) % y_stride
    lowest = min(floor, start % y_stride, goal % y_stride)
    goal_x, goal_y, goal_z = goal // x_stride, goal % x_stride // y_stride, goal % y_stride
    neighbours = _neighbours(x_stride, y_stride, step)
    costs = {start: 0.0}
    came_from: dict[int, int] = {}
    done: set[int] = set()
    queue = [(0.0, start)]
    while queue:
        _, cell = heapq.heappop(queue)
        if cell in done:
            continue
        x, y, z = (
            cell // x_stride - goal_x,
            cell % x_stride // y_stride - goal_y,
            cell % y_stride - goal_z,
        )
        if -step < x < step and -step < y < step and -step < z < step:
            return grid.centres(_path(came_from, cell, goal))
        done.add(cell)
        if len(done) > max_nodes:
            return None
        cost = costs[cell]
        for offset, between, length, rise in neighbours:
            neighbour = cell + offset
            if occupied[neighbour] or neighbour in done:
                continue
            new_cost = cost + length
            if new_cost >= costs.get(neighbour, math.inf) or goal_z + z + rise < lowest:
                continue
            if any(occupied[cell + part] for part in between):
                continue
            costs[neighbour] = new_cost
            came_from[neighbour] = cell
            dx, dy, dz = (
                neighbour // x_stride - goal_x,
                neighbour % x_stride // y_stride - goal_y,
                z + rise,
            )
            heuristic = math.sqrt(dx * dx + dy * dy + dz * dz)
            heapq.heappush(queue, (new_cost + weight * heuristic, neighbour))
    return None


@lru_cache(maxsize=4)
def _neighbours(
    x_stride: int, y_stride: int, step: int
) -> tuple[tuple[int, tuple[int, ...], float, int], ...]:
    """Return flat offset, offsets of cells in between, distance and rise of each neighbour."""
    found = []
    for x, y, z in itertools.product((-1, 0, 1), repeat=3):
        if x or y or z:
            unit = x * x_stride + y * y_stride + z
            between = tuple(unit * share for share in range(1, step))
            length = step * math.sqrt(x * x + y * y + z * z)
            found.append((unit * step, between, length, z * step))
    return tuple(found)


def _path(came_from: dict[int, int], cell: int, goal: int) -> NDArray[np.intp]:
    cells = [cell]
    while cells[-1] in came_from:
        cells.append(came_from[cells[-1]])
    cells.reverse()
    return np.array(cells if cell == goal else [*cells, goal])
