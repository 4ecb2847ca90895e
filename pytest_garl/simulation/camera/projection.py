"""One frame's geometry: from the world to the camera's pixels."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import BELLY_M, Camera
from pytest_garl.scenarios.bodies import rotate
from pytest_garl.simulation.camera.meshes import clip_polygon, rotation_matrix
from pytest_garl.simulation.camera.true_camera import mount_of, product

Array = NDArray[np.float32]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
NEAR_M = 0.05
FAR_M = 100.0
_FARTHEST_PX = np.float32(2e4)
"""Pixel coordinates are bounded so that fixed-point drawing does not overflow."""


def eye_under(position_m: Vector, attitude: Quaternion, offset_m: Vector = BELLY_M) -> Vector:
    """Return the place in the world of a camera at ``offset_m`` of a UAV at ``position_m``."""
    dx, dy, dz = rotate(attitude, offset_m)
    return position_m[0] + dx, position_m[1] + dy, position_m[2] + dz


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """A camera at ``eye`` (3,), in metres, with ``axes`` (3, 3): rows right, down and forward."""

    camera: Camera
    eye: NDArray[np.float64]
    axes: NDArray[np.float64]

    @classmethod
    def of(cls, camera: Camera, position_m: Vector, q: Quaternion) -> View:
        """Return the view of a camera at ``position_m``, on a UAV with attitude ``q``."""
        body = rotation_matrix(product(q, mount_of(camera)) if camera.is_turned else q)
        axes = np.empty((3, 3))
        for row, column in zip(axes, (1, 0, 2), strict=True):
            np.negative(body[:, column], out=row)
        return cls(camera=camera, eye=np.array(position_m), axes=axes)

    @cached_property
    def ground_of_pixel(self) -> NDArray[np.float64]:
        """Matrix (3, 3) from homogeneous pixels to homogeneous world (x, y) on the ground."""
        rays = self.axes.T @ _ray_of_pixel(self.camera)
        x, y, z = self.eye
        ground = np.empty((3, 3))
        ground[0] = x * rays[2] - z * rays[0]
        ground[1] = y * rays[2] - z * rays[1]
        ground[2] = rays[2]
        return ground

    def pixels(self, seen: NDArray[Any]) -> Array:
        """Project camera-frame points (n, 3), all in front, to pixels (n, 2)."""
        scale = self.camera.focal_px / seen[:, 2]
        pixels = np.empty((len(seen), 2), np.float32)
        np.multiply(seen[:, 0], scale, out=pixels[:, 0], casting="same_kind")
        np.multiply(seen[:, 1], scale, out=pixels[:, 1], casting="same_kind")
        pixels += self._centre
        np.minimum(pixels, _FARTHEST_PX, out=pixels)
        return np.maximum(pixels, -_FARTHEST_PX, out=pixels)

    def ground_polygon(self, points: NDArray[np.float64]) -> Array:
        """Project a polygon on the ground (n, 2) to pixels (m, 2), clipped at the near plane."""
        seen = points @ self.axes[:, :2].T - self.axes @ self.eye
        clipped = clip_polygon(seen.astype(np.float32), NEAR_M)
        return self.pixels(clipped) if len(clipped) else np.zeros((0, 2), np.float32)

    def ground_polygons(
        self, points: NDArray[np.float64], lengths: Sequence[int]
    ) -> tuple[Array, list[int]]:
        """Project polygons on the ground that lie one after the other in ``points`` (n, 2).

        Returns pixels (m, 2) and the polygons' lengths after clipping.
        """
        seen = points @ self.axes[:, :2].T - self.axes @ self.eye
        if seen[:, 2].min() > NEAR_M:
            return self.pixels(seen), list(lengths)
        parts = np.split(seen.astype(np.float32), np.cumsum(lengths)[:-1])
        clipped = [part for part in (clip_polygon(p, NEAR_M) for p in parts) if len(part) >= 3]
        if not clipped:
            return np.zeros((0, 2), np.float32), []
        return self.pixels(np.concatenate(clipped)), [len(part) for part in clipped]

    def box(self, pixels: NDArray[Any]) -> tuple[slice, slice]:
        """Return the rows and columns of the frame that hold projected points (n, 2)."""
        if len(pixels) == 0:
            return slice(0, 0), slice(0, 0)
        u, v = pixels[:, 0], pixels[:, 1]
        width, height = self.camera.width_px, self.camera.height_px
        return (
            slice(_within(float(v.min()) - 1, height), _within(float(v.max()) + 2, height)),
            slice(_within(float(u.min()) - 1, width), _within(float(u.max()) + 2, width)),
        )

    def shows(self, x: float, y: float, z: float, radius_m: float) -> bool:
        """Whether a ball at camera-frame (x, y, z), in metres, touches the view's pyramid."""
        reach_x, reach_y = self.reach
        return (
            -radius_m <= z <= FAR_M
            and abs(x) - reach_x * z < radius_m * math.hypot(1, reach_x)
            and abs(y) - reach_y * z < radius_m * math.hypot(1, reach_y)
        )

    @cached_property
    def _centre(self) -> Array:
        return np.array(self.camera.centre_px, np.float32)

    @cached_property
    def reach(self) -> tuple[float, float]:
        """Half the frame's width and height as tangents."""
        camera = self.camera
        return camera.width_px / 2 / camera.focal_px, camera.height_px / 2 / camera.focal_px


@functools.lru_cache(maxsize=8)
def _ray_of_pixel(camera: Camera) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from homogeneous pixels to rays in the camera's frame."""
    inverse = np.asarray(np.linalg.inv(camera.matrix), np.float64)
    inverse.setflags(write=False)
    return inverse


def ground_depth(view: View, columns: Array, rows: Array) -> tuple[Array, bool]:
    """Return the ground's planar depth, and whether some ray misses the ground."""
    across, down, level = view.ground_of_pixel[2].astype(np.float32)
    slope = np.add(across * columns, down * rows + level)
    up = float(view.eye[2])
    highest = float(max(slope[0, 0], slope[0, -1], slope[-1, 0], slope[-1, -1]))
    horizon = highest > -up / FAR_M
    if not horizon:
        return np.divide(np.float32(-up), slope, out=slope), False
    # Exactly the far plane: beyond it by a rounding the rasteriser writes no depth, and short
    # of it the sky would be ground.
    sky = slope >= np.float32(-up / FAR_M)
    slope[sky] = -up / FAR_M
    depth: Array = np.divide(np.float32(-up), slope, out=slope)
    np.minimum(depth, np.float32(FAR_M), out=depth)
    depth[sky] = FAR_M
    return depth, True


def _within(value: float, most: int) -> int:
    return min(most, max(0, math.ceil(value)))
