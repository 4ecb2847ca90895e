"""Collision segments of a spline, and the {p, v} pairs that push its control points out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.astar import find_guide
from landing_systems.modules.planning_ego.bspline import FIXED, sampling_matrix
from landing_systems.modules.planning_ego.errors import GoalInObstacleError
from landing_systems.modules.planning_ego.grid import OccupancyGrid
from landing_systems.modules.planning_ego.parameters import EgoParameters

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pairs:
    """Pairs {p, v}, each of a place on an obstacle and the way out of it.

    Control point ``index`` (m,) shall lie beyond ``base`` (m, 3) along the unit vector
    ``direction`` (m, 3).
    """

    index: NDArray[np.intp]
    base: Array
    direction: Array

    @classmethod
    def none(cls) -> Pairs:
        """Return no pairs."""
        return cls(index=np.zeros(0, np.intp), base=np.zeros((0, 3)), direction=np.zeros((0, 3)))

    def and_also(self, more: Pairs) -> Pairs:
        """Return these and others."""
        return Pairs(
            index=np.concatenate([self.index, more.index]),
            base=np.concatenate([self.base, more.base]),
            direction=np.concatenate([self.direction, more.direction]),
        )

    def distances(self, points: Array) -> Array:
        """Signed distance (m,) of the control points (n, 3) from the obstacle: (Q - p) . v."""
        return np.asarray(np.einsum("ij,ij->i", points[self.index] - self.base, self.direction))


def samples_per_span(parameters: EgoParameters) -> int:
    """Return at how many places of a knot span a curve is checked: two to a cell's side."""
    return max(2, math.ceil(2 * parameters.control_point_distance_m / parameters.resolution_m))


def checked_samples(count: int, per_span: int, share: float) -> int:
    """Return how many samples of a curve of ``count`` control points must be free."""
    return max(1, math.ceil(share * ((count - 3) * per_span + 1)))


class CollisionSearch:
    """Finds where splines with ``count`` control points collide, and the ways out.

    ``checked_share`` of the curve must be free, from the start on.  The start may lie
    within the inflation of an obstacle (a moving one came near): what is within
    ``escape_m`` of it is not checked.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        parameters: EgoParameters,
        count: int,
        *,
        checked_share: float,
        lowest_m: float,
        escape_m: float = 0.0,
    ) -> None:
        self._grid = grid
        self._p = parameters
        self._lowest_m = lowest_m
        self._escape_m = escape_m
        per_span = samples_per_span(parameters)
        self._matrix = sampling_matrix(count, per_span)
        self._checked = checked_samples(count, per_span, checked_share)
        knots = np.arange(len(self._matrix)) / per_span
        # Near the knot k the curve is drawn most by the control point k + 1.
        self._owner = np.floor(knots + 1.5).astype(np.intp)
        self._movable = FIXED, count - FIXED - 1

    def is_free(self, points: Array) -> bool:
        """Whether the checked part of the curve of control points (n, 3) collides nowhere."""
        return not self._hits(self._matrix[: self._checked] @ points).any()

    def colliding(self, points: Array) -> NDArray[np.bool_]:
        """Mark (n,) the movable control points whose part of the curve collides."""
        hits = self._hits(self._matrix[: self._checked] @ points)
        marks = np.zeros(len(points), bool)
        low, high = self._movable
        marks[self._owner[: self._checked][hits]] = True
        marks[:low] = marks[high + 1 :] = False
        return marks

    def pairs(self, points: Array, among: NDArray[np.intp] | None = None) -> Pairs | None:
        """Return the pairs for all collision segments of the curve, or None without guide.

        With ``among`` only segments of these control points are looked at, and only these
        get pairs.  Raises GoalInObstacleError if the curve does not come free again.
        """
        curve = self._matrix @ points
        hits = self._hits(curve)
        result = Pairs.none()
        for before, after in _runs(hits, self._checked):
            if after == len(curve):
                x, y, z = curve[-1]
                raise GoalInObstacleError(
                    f"the trajectory's end at ({x:.2f}, {y:.2f}, {z:.2f}) m is within an inflated "
                    "obstacle; planning is skipped until the goal moves or is clear"
                )
            owners = np.unique(self._owner[before + 1 : after])
            low, high = self._movable
            owners = owners[(owners >= low) & (owners <= high)]
            if among is not None:
                owners = np.intersect1d(owners, among)
                if not len(owners):
                    continue
            guide = self._guide(curve[before], curve[after]) if len(owners) else None
            if guide is None:
                return None
            result = result.and_also(self._push(points, owners, guide))
        return result

    def _hits(self, curve: Array) -> NDArray[np.bool_]:
        hits = self._grid.occupied(curve)
        if self._escape_m > 0:
            offsets = curve - curve[0]
            hits &= np.einsum("ij,ij->i", offsets, offsets) > self._escape_m**2
        return hits

    def _guide(self, start: Array, end: Array) -> Array | None:
        p = self._p
        if self._escape_m > 0:
            outside = self._grid.nearest_free(start, self._escape_m, self._lowest_m)
            start = start if outside is None else outside
        return find_guide(
            self._grid,
            start,
            end,
            lowest_m=self._lowest_m,
            step=p.astar_step,
            weight=p.astar_weight,
            max_nodes=p.astar_max_nodes,
        )

    def _push(self, points: Array, owners: NDArray[np.intp], guide: Array) -> Pairs:
        """Return a pair for each control point of a segment that its guide leads around."""
        found: list[tuple[int, Array, Array]] = []
        for owner in owners:
            point = points[owner]
            aim = _crossing(guide, point, points[owner + 1] - points[owner - 1])
            if aim is None:
                continue
            way = point - aim
            length = float(np.linalg.norm(way))
            if length > 1e-3:
                found.append((int(owner), self._surface(aim, way, length), -way / length))
        if not found:
            return Pairs.none()
        # The plane of a control point at a segment's end may miss the guide: it follows its
        # neighbour.
        nearest = [min(found, key=lambda item: abs(item[0] - owner)) for owner in owners]
        return Pairs(
            index=owners,
            base=np.stack([item[1] for item in nearest]),
            direction=np.stack([item[2] for item in nearest]),
        )

    def _surface(self, aim: Array, way: Array, length: float) -> Array:
        """Return the last free place on the way from the guide to the control point."""
        count = math.ceil(2 * length / self._p.resolution_m) + 1
        line = aim + np.linspace(0.0, 1.0, count)[:, None] * way
        occupied = self._grid.occupied(line)
        first = int(occupied.argmax()) if occupied.any() else count
        return np.asarray(line[max(0, first - 1)])


def _runs(hits: NDArray[np.bool_], checked: int) -> list[tuple[int, int]]:
    """Return (last free, next free) sample of each run of hits that begins in the checked part.

    The next free is ``len(hits)`` where there is none.
    """
    padded = np.concatenate([[False], hits, [False]])
    edges = np.flatnonzero(padded[1:] != padded[:-1])
    return [
        (max(0, int(first) - 1), int(after))
        for first, after in zip(edges[::2], edges[1::2], strict=True)
        if first < checked
    ]


def _crossing(guide: Array, point: Array, normal: Array) -> Array | None:
    """Return where a guide (n, 3) crosses the plane through a point, the place nearest to it."""
    side = (guide - point) @ normal
    before = np.flatnonzero((side[:-1] <= 0) != (side[1:] <= 0))
    if not len(before):
        return None
    share = side[before] / (side[before] - side[before + 1])
    places = guide[before] + share[:, None] * (guide[before + 1] - guide[before])
    return np.asarray(places[((places - point) ** 2).sum(axis=1).argmin()])
