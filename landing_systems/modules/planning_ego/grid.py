"""The occupancy grid: what the depth camera has shown to be solid, grown by the UAV's size."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from landing_systems.modules.planning_ego.parameters import EgoParameters
from landing_systems.modules.planning_ego.rays import RayCaster
from pytest_garl import Camera

Points = NDArray[np.float64]
Cells = NDArray[np.intp]


class OccupancyGrid:
    """A grid of log-odds, fixed in the world, about ``centre_m`` (x, y).

    - What was never seen is free, as upstream: a camera that looks down does not show what
      stands beside the UAV unless it was seen from higher up or from afar.
    - A cell with a hit in a frame is hit, whatever passes through it as well (OctoMap's
      rule; upstream lets the majority decide).
    - With ``fill_below`` everything under a solid cell is occupied: of a wall such a camera
      sees the top.
    - Below ``ground_height_m`` there is no obstacle; what is asked there gets the answer of
      the lowest layer, so that the ground blocks no landing but a dog does.
    - Outside of the grid, to the sides and above, everything is occupied.
    - Cells which a moving thing has left are cleared when rays pass through them; those
      that nobody looks at any more stay, as upstream, or are forgotten (``forget_after_s``).
    """

    def __init__(
        self, parameters: EgoParameters, camera: Camera, centre_m: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        p = self._p = parameters
        cell = p.resolution_m
        height = min(p.map_size_m[2], p.ceiling_m - p.ground_height_m)
        sizes = (p.map_size_m[0], p.map_size_m[1], height)
        self.shape = np.array([max(1, round(size / cell)) for size in sizes])
        self.origin_m = np.array([centre_m[0], centre_m[1], p.ground_height_m])
        self.origin_m[:2] -= self.shape[:2] * cell / 2
        upright = p.inflation_m if p.vertical_inflation_m is None else p.vertical_inflation_m
        # Cubes of cells that would be rounded up by a rounding error are not.
        self._growth = np.array(
            [math.ceil(grow / cell - 1e-9) for grow in (p.inflation_m, p.inflation_m, upright)]
        )
        # So wide that neither growing nor the guide's search leaves the array.
        self._border = np.maximum(self._growth, p.astar_step)
        x, y, z = self.shape + 2 * self._border
        self.strides = np.array([y * z, z, 1])
        self._caster = RayCaster(camera, p)
        self._floor = _log_odds(p.p_min)
        self._top = _log_odds(p.p_max)
        self._threshold = _log_odds(p.p_occupied)
        self._hit, self._miss = _log_odds(p.p_hit), _log_odds(p.p_miss)
        cells = int(x * y * z)
        # Flat arrays over the grid and its border; the border is never solid but occupied.
        self._odds = np.full(cells, self._floor, np.float32)
        self._solid = np.zeros(cells, bool)
        self._hit_at = np.zeros(cells, np.float32)
        self._solid_since = np.zeros(cells, np.float32)
        self._raised: Cells = np.zeros(0, np.intp)
        around = np.ones((x, y, z), np.int16)
        around[tuple(slice(b, -b) for b in self._border)] = 0
        self.occupancy = around.reshape(-1)
        """How many solid cells reach each cell; flat, with ``strides``."""
        # Highest solid cell of each column, counted from the array's lower end; for fill_below.
        self._tops = np.full(int(x * y), -1, np.intp)
        grown = [np.arange(-g, g + 1) for g in self._growth]
        if p.fill_below:
            grown[2] = np.zeros(1, int)
        steps = np.meshgrid(*grown, indexing="ij")
        self._stamp = sum(
            step.ravel() * stride for step, stride in zip(steps, self.strides, strict=True)
        )

    def observe(
        self,
        time_s: float,
        position_m: Points,
        attitude: NDArray[np.float64],
        depth_m: NDArray[np.float32],
    ) -> None:
        """Enter a planar depth image (H, W) taken by a UAV at ``position_m`` (3,).

        ``attitude`` is the quaternion x, y, z, w.
        """
        p = self._p
        rotation = Rotation.from_quat(attitude).as_matrix()
        eye = position_m + rotation @ np.array(p.camera_offset_m)
        hits = np.unique(self._inside(self._caster.hits(depth_m, eye, rotation)))
        known = self._raised
        through = known[self._caster.seen_through(self.centres(known), depth_m, eye, rotation)]
        self._hit_at[hits] = time_s
        fresh = hits[self._odds[hits] <= self._floor]
        missed = through[self._hit_at[through] != np.float32(time_s)]
        self._odds[missed] = np.maximum(self._odds[missed] + self._miss, self._floor)
        self._odds[hits] = np.minimum(self._odds[hits] + self._hit, self._top)
        self._raised = np.concatenate([known, fresh])
        if p.forget_after_s is not None:
            stood_s = self._hit_at[known] - self._solid_since[known]
            unseen = time_s - self._hit_at[known] > p.forget_after_s
            self._odds[known[unseen & (stood_s < p.static_after_s)]] = self._floor
        self._settle(time_s)

    def add_solid(self, time_s: float, points_m: Points) -> None:
        """Enter points (n, 3) that are known to be solid, as from a map; misses clear them."""
        cells = np.unique(self._inside(points_m))
        fresh = cells[self._odds[cells] <= self._floor]
        self._odds[cells] = self._top
        self._hit_at[cells] = time_s
        self._raised = np.concatenate([self._raised, fresh])
        self._settle(time_s)

    def occupied(self, points_m: Points) -> NDArray[np.bool_]:
        """Whether points (n, 3) lie within the inflated obstacles, or outside of the grid."""
        return np.asarray(self.occupancy[self.index(points_m)] > 0)

    def index(self, points_m: Points) -> Cells:
        """Return flat indices into ``occupancy`` of points (n, 3); outside is the border."""
        border = self._border
        cells = (points_m - self.origin_m) * (1 / self._p.resolution_m) + border
        lowest = border - (1, 1, 0)
        clipped = np.minimum(np.maximum(cells, lowest), border + self.shape)
        flat: Cells = clipped.astype(np.intp) @ self.strides
        return flat

    def centres(self, index: Cells) -> Points:
        """Centres (n, 3) of the cells with these flat indices."""
        x, rest = np.divmod(index, self.strides[0])
        y, z = np.divmod(rest, self.strides[1])
        cells = np.stack([x, y, z], axis=-1) - self._border + 0.5
        return np.asarray(self.origin_m + cells * self._p.resolution_m)

    def obstacles_m(self) -> Points:
        """Centres (n, 3) of the cells that are solid, not inflated."""
        return self.centres(np.flatnonzero(self._solid))

    def obstacles_beside(
        self, start_m: Points, end_m: Points, within_m: float, most: int
    ) -> Points:
        """Centres (n, 3) of the solid cells nearest to a line (x, y) seen from above, to report.

        They are no farther from it than ``within_m``, and at most ``most``.
        """
        # All solid cells are among those with raised log-odds, and these are few.
        centres = self.centres(self._raised[self._solid[self._raised]])
        way, apart = end_m - start_m, centres[:, :2] - start_m
        share = np.clip((apart * way).sum(axis=1) / max(float((way * way).sum()), 1e-9), 0.0, 1.0)
        off_m = np.hypot(*(apart - share[:, None] * way).T)
        nearest = np.argsort(off_m, kind="stable")[:most]
        return np.asarray(centres[nearest[off_m[nearest] <= within_m]])

    def probability(self, point_m: tuple[float, float, float]) -> float:
        """How probably the cell around a point of the grid is solid."""
        odds = float(self._odds[self.index(np.array([point_m]))[0]])
        return 1 / (1 + math.exp(-odds))

    def nearest_free(self, point_m: Points, within_m: float, lowest_m: float) -> Points | None:
        """Return the nearest centre (3,) of a free cell, or None.

        It is no farther off than ``within_m`` on any axis and not below ``lowest_m``.
        """
        cell = self._p.resolution_m
        steps = np.arange(-math.ceil(within_m / cell), math.ceil(within_m / cell) + 1) * cell
        cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        centres = self.centres(self.index(point_m + cube))
        centres = centres[(centres[:, 2] >= lowest_m) & ~self.occupied(centres)]
        if not len(centres):
            return None
        return np.asarray(centres[((centres - point_m) ** 2).sum(axis=1).argmin()])

    def _inside(self, points_m: Points) -> Cells:
        """Flat indices of those points (n, 3) that are in the grid."""
        cells = np.floor((points_m - self.origin_m) / self._p.resolution_m).astype(np.intp)
        inside = ((cells >= 0) & (cells < self.shape)).all(axis=1)
        flat: Cells = (cells[inside] + self._border) @ self.strides
        return flat

    def _settle(self, time_s: float) -> None:
        """Bring what is solid and inflated in line with the log-odds."""
        raised = self._raised
        odds = self._odds[raised]
        solid = odds >= self._threshold
        differs = solid != self._solid[raised]
        changed, state = raised[differs], solid[differs]
        self._solid[changed] = state
        self._solid_since[changed[state]] = time_s
        self._raised = raised[odds > self._floor]
        if self._p.fill_below:
            self._settle_columns(np.unique(changed // self.strides[1]))
        else:
            self._reach(changed[state], 1)
            self._reach(changed[~state], -1)

    def _settle_columns(self, columns: Cells) -> None:
        """Renew the tops of columns, below which all is occupied."""
        height = int(self.strides[1])
        solid = self._solid.reshape(-1, height)[columns]
        tops = np.where(solid.any(axis=1), height - 1 - solid[:, ::-1].argmax(axis=1), -1)
        before = self._tops[columns]
        self._tops[columns] = tops
        grow = self._growth[2]
        levels = np.arange(height)
        was = (before[:, None] >= 0) & (levels <= before[:, None] + grow)
        now = (tops[:, None] >= 0) & (levels <= tops[:, None] + grow)
        cells = columns[:, None] * height + levels
        self._reach(cells[now & ~was], 1)
        self._reach(cells[was & ~now], -1)

    def _reach(self, cells: Cells, change: int) -> None:
        """Let cells reach all those that they inflate to, or no longer."""
        # Cells are reached several times over, so that plain addition would not do.
        np.add.at(self.occupancy, cells[:, None] + self._stamp, np.int16(change))


def _log_odds(probability: float) -> float:
    return math.log(probability / (1 - probability))
