"""Whether something is, or moves in, below the UAV: a grid that remembers what was bare.

A descending UAV looks at the depth image alone.  What stands in its column is in the way at once;
what moves is in the way from farther off, since it may be below a second later.  Trees and
benches beside the column never are.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.lens import undistorted
from pytest_garl import Mission, Observation

CELL_M = 0.25
GRID_M = 40.0
STRIDE_PX = 4
SOMETHING_M = 0.3
"""Points this high above the ground are something."""
MEMORY_S = 5.0
NEW_S = 1.5
FORGET_S = 3.0
"""What was bare ground within five seconds and is covered for less than one and a half has
something moving on it; edges that flicker in and out of a cell are covered all the time."""
MOVING_M, STANDING_M = 2.0, 1.0
"""How near the column below something may move, or stand."""
POINTS = 3
"""Fewer points are noise at an edge."""


class MovementWatch:
    """A grid that remembers since when each cell is covered and when it was bare."""

    def __init__(self, mission: Mission) -> None:
        camera = mission.camera
        (cx, cy), focal = camera.centre_px, camera.focal_px
        rows, columns = np.mgrid[0 : camera.height_px : STRIDE_PX, 0 : camera.width_px : STRIDE_PX]
        if camera.distortion:
            seen = undistorted(np.stack([columns, rows], axis=-1).reshape(-1, 2), camera)
            columns, rows = seen.T.reshape(2, *rows.shape)
        # Rays in the body frame per metre of planar depth: x forward, y left, z up.
        self._rays = np.stack(
            [(cy - rows) / focal, (cx - columns) / focal, -np.ones(rows.shape)], axis=-1
        )
        self._size = round(GRID_M / CELL_M)
        x, y = mission.gps_position_m
        self._origin = np.array([x - GRID_M / 2, y - GRID_M / 2])
        self._bare_at, self._covered_at, self._covered_since = (
            np.full((self._size, self._size), -np.inf, np.float32) for _ in range(3)
        )

    def in_the_way(self, observation: Observation) -> bool:
        """Take in a frame; whether something is in the column below or moves in near it."""
        return self.points_in_the_way(observation) >= POINTS

    def points_in_the_way(self, observation: Observation) -> int:
        """Count the points of the depth image that stand in the column or move in near it."""
        now, place = observation.time_s, np.asarray(observation.position_m)
        depth = observation.depth_m[::STRIDE_PX, ::STRIDE_PX, None]
        world = place + (self._rays * depth) @ _rotation(observation.attitude).T
        cells = ((world[..., :2] - self._origin) / CELL_M).astype(int)
        inside = ((cells >= 0) & (cells < self._size)).all(axis=-1)
        # A depth of 0 is no measurement: neither bare ground nor a thing.
        inside &= depth[..., 0] > 0
        height = world[..., 2]
        # A cell counts as bare only if all around it was bare as well: edges are unsure.
        bare_at = cv2.erode(self._bare_at, np.ones((3, 3), np.uint8))
        high = inside & (height > SOMETHING_M) & (height < place[2])
        rows, columns = cells[high].T
        fresh = now - self._covered_at[rows, columns] > FORGET_S
        self._covered_since[rows[fresh], columns[fresh]] = now
        self._covered_at[rows, columns] = now
        new = now - self._covered_since[rows, columns] < NEW_S
        moved = new & (now - bare_at[rows, columns] < MEMORY_S)
        away = np.hypot(*(world[high][:, :2] - place[:2]).T)
        rows, columns = cells[inside & (height < SOMETHING_M / 2)].T
        self._bare_at[rows, columns] = now
        return int(np.count_nonzero((moved & (away < MOVING_M)) | (away < STANDING_M)))


def _rotation(attitude: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z, w = attitude
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
