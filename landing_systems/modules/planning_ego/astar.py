"""A* on the inflated grid: the guide that shows on which side to pass an obstacle."""

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

    26 neighbours, ``step`` cells away with all between them free; Euclidean lengths and
    heuristic.  ``weight`` on the heuristic makes the search greedy: paths are at most so
    many times too long.  No cell lies below ``lowest_m``, unless at the start's or the
    goal's height.  None also if start or goal are occupied or ``max_nodes`` cells have been
    expanded.  Ties go to the cell of the smaller index, so that equal grids give equal
    paths.
    """
    start, goal = (int(cell) for cell in grid.index(np.stack([start_m, goal_m])))
    occupied = grid.occupancy.data
    if occupied[start] or occupied[goal]:
        return None
    lines, line = (int(stride) for stride in grid.strides[:2])
    floor = int(grid.index(np.array([[start_m[0], start_m[1], lowest_m]]))[0]) % line
    lowest = min(floor, start % line, goal % line)
    goal_x, goal_y, goal_z = goal // lines, goal % lines // line, goal % line
    neighbours = _neighbours(lines, line, step)
    costs = {start: 0.0}
    came_from: dict[int, int] = {}
    done: set[int] = set()
    queue = [(0.0, start)]
    while queue:
        _, cell = heapq.heappop(queue)
        if cell in done:
            continue
        x, y, z = cell // lines - goal_x, cell % lines // line - goal_y, cell % line - goal_z
        if -step < x < step and -step < y < step and -step < z < step:
            return grid.centres(_path(came_from, cell, goal))
        done.add(cell)
        if len(done) > max_nodes:
            return None
        cost = costs[cell]
        for offset, between, length, rise in neighbours:
            near = cell + offset
            if occupied[near] or near in done:
                continue
            there = cost + length
            if there >= costs.get(near, math.inf) or goal_z + z + rise < lowest:
                continue
            if any(occupied[cell + part] for part in between):
                continue
            costs[near] = there
            came_from[near] = cell
            dx, dy, dz = near // lines - goal_x, near % lines // line - goal_y, z + rise
            ahead = math.sqrt(dx * dx + dy * dy + dz * dz)
            heapq.heappush(queue, (there + weight * ahead, near))
    return None


@lru_cache(maxsize=4)
def _neighbours(
    lines: int, line: int, step: int
) -> tuple[tuple[int, tuple[int, ...], float, int], ...]:
    """Of each neighbour: flat offset, offsets of the cells between, distance and rise in cells."""
    found = []
    for x, y, z in itertools.product((-1, 0, 1), repeat=3):
        if x or y or z:
            unit = x * lines + y * line + z
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
