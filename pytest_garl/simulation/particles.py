"""What falls between the camera and the ground: rain, snow and maple leaves."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.weather import Conditions, rain_speed_mps

_EXPOSURE_S = 0.005
_BOX_M = (6.0, 6.0, 8.0)
"""Particles live in a box of this size that repeats in space; those beyond 8 m of depth are
below a pixel and are part of the extinction."""
_MOST = 600
_SNOW_SPEED_MPS = 1.2
"""Snowflakes fall at 1 to 1.5 m/s (Locatelli and Hobbs 1974)."""
_LEAF_SPEED_MPS = 1.5
"""Engineering estimate of a tumbling leaf."""
_RAIN_SEEN_PER_MMPH = 4.0
"""Drops over 2 mm per cubic metre and mm/h: the Marshall-Palmer distribution (1948) at
10 mm/h has about 40 of them."""
_SNOW_SEEN_PER_MMPH = 60.0
"""Flakes over 3 mm per cubic metre and mm/h: Gunn and Marshall (1958), order of magnitude."""


class Particles:
    """Falling things as functions of time, fixed by the flight's seed."""

    def __init__(self, camera: Camera, conditions: Conditions, rng: np.random.Generator) -> None:
        self._camera = camera
        volume = math.prod(_BOX_M)
        wanted = (
            (
                "rain",
                conditions.rain_mmph * _RAIN_SEEN_PER_MMPH * volume,
                rain_speed_mps(2.5),
                0.0025,
            ),
            ("snow", conditions.snow_mmph * _SNOW_SEEN_PER_MMPH * volume, _SNOW_SPEED_MPS, 0.006),
            ("leaf", conditions.leaves_per_m3 * volume, _LEAF_SPEED_MPS, 0.11),
        )
        self._clouds = []
        for kind, number, speed, size in wanted:
            # The draws are made for every kind so that one gene does not shift another's.
            places = rng.uniform(0, 1, (_MOST, 3)) * np.array(_BOX_M)
            angles = rng.uniform(0, 2 * math.pi, (_MOST, 2))
            count = min(_MOST, round(number))
            if count:
                self._clouds.append((kind, places[:count], angles[:count], speed, size))

    def draw(
        self,
        image: NDArray[np.uint8],
        depth: NDArray[np.float32],
        axes: NDArray[np.float64],
        eye: NDArray[np.float64],
        time_s: float,
    ) -> None:
        """Draw what falls in front of what the frame shows; ``axes`` are the camera's."""
        (cx, cy), focal = self._camera.centre_px, self._camera.focal_px
        height, width = depth.shape
        box = np.array(_BOX_M)
        for kind, places, angles, speed, size in self._clouds:
            fallen = places - np.array([0.0, 0.0, speed * time_s])
            relative = np.mod(fallen - eye + box / 2, box) - box / 2
            relative[:, 2] -= box[2] / 2
            seen = relative @ axes.T
            z = seen[:, 2]
            front = z > 0.15
            u = cx + focal * seen[:, 0] / np.maximum(z, 0.15)
            v = cy + focal * seen[:, 1] / np.maximum(z, 0.15)
            inside = front & (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
            index = np.flatnonzero(inside)
            if len(index) == 0:
                continue
            index = index[depth[v[index].astype(int), u[index].astype(int)] > z[index]]
            if kind == "leaf":
                self._leaves(image, u[index], v[index], z[index], angles[index], size, time_s)
            else:
                ends = seen[index] + axes @ np.array([0.0, 0.0, -speed * _EXPOSURE_S])
                far = np.maximum(ends[:, 2:], 0.1)
                tails = focal * ends[:, :2] / far + np.array([cx, cy])
                heads = np.column_stack([u[index], v[index]])
                self._streaks(image, heads, tails, focal * size / z[index], kind)

    def _streaks(
        self,
        image: NDArray[np.uint8],
        heads: NDArray[np.float64],
        tails: NDArray[np.float64],
        width_px: NDArray[np.float64],
        kind: str,
    ) -> None:
        colour = (214, 220, 226) if kind == "rain" else (240, 244, 250)
        lines = np.stack([heads, tails], axis=1)
        for thickness in (1, 2, 4, 7):
            low, high = {1: (0.3, 1.5), 2: (1.5, 3), 4: (3, 5.5), 7: (5.5, 1e9)}[thickness]
            chosen = lines[(width_px >= low) & (width_px < high)]
            if len(chosen):
                points = np.round(chosen * 16).astype(np.int32)
                cv2.polylines(image, list(points), False, colour, thickness, cv2.LINE_AA, 4)

    def _leaves(
        self,
        image: NDArray[np.uint8],
        u: NDArray[np.float64],
        v: NDArray[np.float64],
        z: NDArray[np.float64],
        angles: NDArray[np.float64],
        size: float,
        time_s: float,
    ) -> None:
        focal = self._camera.focal_px
        lobes = np.linspace(0, 2 * math.pi, 10, endpoint=False)
        shape = np.where(np.arange(10) % 2 == 0, 1.0, 0.55)
        for x, y, far, (turn, tumble) in zip(u, v, z, angles, strict=True):
            radius = focal * size / 2 / far
            flat = abs(math.cos(tumble + 4.0 * time_s))
            around = lobes + turn + 2.0 * time_s
            outline = np.column_stack(
                [x + radius * shape * np.cos(around), y + radius * shape * flat * np.sin(around)]
            )
            colour = (186, 104, 34) if turn < math.pi else (156, 62, 34)
            points = np.round(outline * 16).astype(np.int32)
            cv2.fillPoly(image, [points], colour, cv2.LINE_AA, 4)
