"""Ray casting: what a depth image shows to be hit, and what it sees through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.planning_ego.parameters import EgoParameters
from pytest_garl import Camera

Floats = NDArray[np.float64]


class RayCaster:
    """Casts the rays of a depth image, forwards for hits and backwards for misses.

    A miss changes only a cell that was hit before: all others are at the lower clamp
    already.  So instead of walking along each ray through thousands of cells that are
    known to be free, the ray through each cell in question is looked up in the image.
    Raises ValueError if the margin of pixels leaves no ray.
    """

    def __init__(self, camera: Camera, parameters: EgoParameters) -> None:
        self._p = parameters
        self._camera = camera
        margin = parameters.pixel_margin
        across = np.arange(margin, camera.width_px - margin, parameters.pixel_step)
        down = np.arange(margin, camera.height_px - margin, parameters.pixel_step)
        if not len(across) or not len(down):
            raise ValueError(
                f"pixel_margin {margin} leaves no ray of an image of "
                f"{camera.width_px}x{camera.height_px}; expected less"
            )
        self._used = tuple(
            slice(margin, size - margin, parameters.pixel_step)
            for size in (camera.height_px, camera.width_px)
        )
        (cx, cy), f = camera.centre_px, camera.focal_px
        # Of depth 1 in the body frame: image right is -y, image down is -x, the axis -z.
        self._y = (cx - across) / f
        self._x = (cy - down)[:, None] / f

    def hits(self, depth_m: NDArray[np.float32], eye_m: Floats, rotation: Floats) -> Floats:
        """Return where rays end on something (n, 3), above the ground and within range.

        ``eye_m`` is the camera's place, ``rotation`` (3, 3) turns body into world vectors.  Raises
        ValueError if the depth image has not the camera's shape.
        """
        p = self._p
        shape = self._camera.height_px, self._camera.width_px
        if depth_m.shape != shape:
            raise ValueError(f"the depth image is {depth_m.shape}; expected {shape}")
        depth = depth_m[self._used]
        # Most rays end on the ground: their height alone is worked out before they go.
        slope = rotation[2, 0] * self._x + rotation[2, 1] * self._y - rotation[2, 2]
        above = depth * slope > p.ground_height_m - eye_m[2]
        rows, columns = np.nonzero(above & (depth >= p.min_depth_m) & (depth <= p.max_ray_m))
        length = depth[rows, columns].astype(np.float64)
        rays = np.stack([self._x[rows, 0], self._y[columns], np.full(len(rows), -1.0)], axis=1)
        offsets = length[:, None] * (rays @ rotation.T)
        return np.asarray(eye_m + offsets[self._in_range(offsets)])

    def seen_through(
        self,
        points_m: Floats,
        depth_m: NDArray[np.float32],
        eye_m: Floats,
        rotation: Floats,
    ) -> NDArray[np.bool_]:
        """Whether rays pass points (n, 3) and end half a cell behind them or later."""
        camera, p = self._camera, self._p
        offsets = points_m - eye_m
        body = offsets @ rotation
        ahead = -body[:, 2]
        (cx, cy), f = camera.centre_px, camera.focal_px
        scale = f / np.maximum(ahead, 1e-6)
        u = np.rint(np.clip(cx - body[:, 1] * scale, -1, camera.width_px)).astype(int)
        v = np.rint(np.clip(cy - body[:, 0] * scale, -1, camera.height_px)).astype(int)
        margin = p.pixel_margin
        seen = (ahead > 0) & self._in_range(offsets)
        seen &= (u >= margin) & (u < camera.width_px - margin)
        seen &= (v >= margin) & (v < camera.height_px - margin)
        depth = depth_m[np.where(seen, v, 0), np.where(seen, u, 0)]
        # A depth that is too small or no number says nothing.
        seen &= depth >= p.min_depth_m
        return np.asarray(seen & (ahead + p.resolution_m / 2 < depth))

    def _in_range(self, offsets: Floats) -> NDArray[np.bool_]:
        """Whether offsets from the camera (n, 3) are within what a frame updates."""
        near = np.einsum("ij,ij->i", offsets, offsets) <= self._p.max_ray_m**2
        return np.asarray(near & (np.abs(offsets) <= self._p.update_range_m).all(axis=1))
