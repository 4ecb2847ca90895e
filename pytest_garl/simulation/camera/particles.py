"""Particles in the air between the camera and the ground: rain, snow and maple leaves."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.projection import View
from pytest_garl.simulation.camera.weather import Conditions, rain_speed_mps

_EXPOSURE_S = 0.005
"""A mean of the 2 to 10 ms of the sensor."""
_DROPS_BOX_M = (3.0, 3.0, 3.0)
_LEAVES_BOX_M = (6.0, 6.0, 8.0)
"""Falling things live in boxes below the camera that repeat in space; those beyond are below
a pixel and part of the extinction."""
_SNOW_SPEED_MPS = 1.2
"""Snowflakes fall at 1 to 1.5 m/s (Locatelli and Hobbs 1974)."""
_LEAF_SPEED_MPS = 1.5
"""Engineering estimate of a tumbling leaf."""
_DROP_MM = 3.0
"""Smaller drops, and flakes that melt to smaller drops, are left to the extinction."""


def _drops_per_m3(rate_mmph: float) -> float:
    """Return the drops over 3 mm: the exponential distribution of Marshall and Palmer (1948)."""
    if rate_mmph <= 0:
        return 0.0
    slope = 4.1 * math.pow(rate_mmph, -0.21)
    return 8000.0 / slope * math.exp(-slope * _DROP_MM)


def _flakes_per_m3(rate_mmph: float) -> float:
    """Return the flakes that melt to over 3 mm: the distribution of Gunn and Marshall (1958)."""
    if rate_mmph <= 0:
        return 0.0
    slope = 2.55 * math.pow(rate_mmph, -0.48)
    return 3800.0 * math.pow(rate_mmph, -0.87) / slope * math.exp(-slope * _DROP_MM)


_LOBES = np.linspace(0, 2 * math.pi, 10, endpoint=False)
_LOBE_REACH = np.where(np.arange(10) % 2 == 0, 1.0, 0.55)
"""A leaf's outline: five lobes, as angles and shares of the radius."""
_LEAF_AREA = 5 * 0.55 * math.sin(math.pi / 5) * 2 / math.pi
"""Area of a leaf's outline for a radius of 1: ten triangles between lobes and notches, seen from a
random side."""
_STREAKS = ((1, 0.3, 1.5), (2, 1.5, 3.0), (4, 3.0, 5.5), (7, 5.5, 1e9))
"""Thickness in pixels with which streaks are drawn, by their width in pixels (from, below)."""
_DEPTHS_M = np.arange(0.15, 8.05, 0.05)
"""Depths at which the expected cover is tabulated: from the nearest drawn to the end of a box."""


class Particles:
    """Falling things as functions of time, fixed by the flight's seed."""

    def __init__(self, camera: Camera, conditions: Conditions, rng: np.random.Generator) -> None:
        self._camera = camera
        rain = _drops_per_m3(conditions.rain_mmph)
        snow = _flakes_per_m3(conditions.snow_mmph)
        leaves = conditions.leaves_per_m3
        wanted = (
            ("rain", rain, _DROPS_BOX_M, 1300, rain_speed_mps(_DROP_MM), 0.003),
            # An aggregate of 12 mm is about four times as wide as the drop to which it melts
            # (density after Brandes et al. 2007).
            ("snow", snow, _DROPS_BOX_M, 1300, _SNOW_SPEED_MPS, 0.012),
            ("leaf", leaves, _LEAVES_BOX_M, 600, _LEAF_SPEED_MPS, 0.11),
        )
        self._clouds = []
        for kind, density, box, most, speed, size in wanted:
            # The draws are made for every kind so that one gene does not shift another's.
            places = rng.uniform(0, 1, (most, 3)) * np.array(box)
            angles = rng.uniform(0, 2 * math.pi, (most, 2))
            count = min(most, round(density * math.prod(box)))
            if count:
                chosen = places[:count].astype(np.float32)
                self._clouds.append((kind, chosen, angles[:count], np.array(box), speed, size))

        self._expected = self._expected_cover()

    def expected_cover(self, depth_m: float) -> float:
        """Return the share of the picture that is expected to be covered nearer than a depth."""
        return float(np.interp(depth_m, _DEPTHS_M, self._expected))

    def _expected_cover(self) -> NDArray[np.float64]:
        """Return the expected cover at each of ``_DEPTHS_M``: 1 - exp(-sum of areas per pixel)."""
        focal, near = self._camera.focal_px, _DEPTHS_M
        areas = np.zeros_like(near)
        for kind, places, _, box, speed, size in self._clouds:
            width_px = focal * size / near
            if kind == "leaf":
                # Drawn outlines are half a pixel wider all around.
                area = _LEAF_AREA * (width_px / 2 + 0.5) ** 2
            else:
                steps = [(width_px >= low) & (width_px < high) for _, low, high in _STREAKS]
                thickness = np.select(steps, [float(each) for each, _, _ in _STREAKS])
                # A streak falls along the optical axis: as long as its distance from the
                # picture's middle, here half of the height's half, times its share of the depth.
                length = self._camera.height_px / 4 * speed * _EXPOSURE_S / near
                # Smoothed lines are a pixel wider; only thick ones are drawn with round ends.
                wide = np.where(thickness > 0, thickness + 1, 0.0)
                area = wide * length + np.where(thickness > 1, math.pi / 4 * wide**2, 0.0)
            per_m = len(places) / float(np.prod(box)) * (near / focal) ** 2
            areas += np.where(near <= box[2], per_m * area, 0.0)
        expected: NDArray[np.float64] = 1 - np.exp(-np.cumsum(areas) * (near[1] - near[0]))
        return expected

    def draw(
        self,
        image: NDArray[np.uint8],
        depth: NDArray[np.float32],
        view: View,
        time_s: float,
    ) -> None:
        """Draw the particles that are in front of the objects in the frame.

        ``image`` has the shape (h, w, 3), ``depth`` (h, w).
        """
        if not self._clouds:
            return
        width, height = self._camera.width_px, self._camera.height_px
        for kind, places, angles, box, speed, size in self._clouds:
            # Reduced before it is made single, so that late times are as exact as early ones.
            shift = np.mod(view.eye - box / 2 + [0.0, 0.0, speed * time_s], box)
            reach = box.astype(np.float32)
            relative = places - shift.astype(np.float32)
            relative += reach * (relative < 0)
            relative -= reach * np.array([0.5, 0.5, 1.0], np.float32)
            seen = relative @ view.axes.T.astype(np.float32)
            front = np.flatnonzero(seen[:, 2] > 0.15)
            pixels = view.pixels(seen[front])
            u, v, z = pixels[:, 0], pixels[:, 1], seen[front, 2]
            inside = np.flatnonzero((u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1))
            far = depth[v[inside].astype(np.intp), u[inside].astype(np.intp)]
            index = inside[far > z[inside]]
            if len(index) == 0:
                continue
            if kind == "leaf":
                turns = angles[front[index]]
                self._leaves(image, u[index], v[index], z[index], turns, size, time_s)
            else:
                blur = view.axes @ [0.0, 0.0, -speed * _EXPOSURE_S]
                ends = seen[front[index]] + blur.astype(np.float32)
                ends[:, 2] = np.maximum(ends[:, 2], 0.1)
                lines = np.stack([pixels[index], view.pixels(ends)], axis=1)
                self._streaks(image, lines, self._camera.focal_px * size / z[index], kind)

    def _streaks(
        self,
        image: NDArray[np.uint8],
        lines: NDArray[np.float32],
        width_px: NDArray[np.float32],
        kind: str,
    ) -> None:
        colour = (214, 220, 226) if kind == "rain" else (240, 244, 250)
        for thickness, low, high in _STREAKS:
            chosen = lines[(width_px >= low) & (width_px < high)]
            if len(chosen):
                points = np.round(chosen * 16).astype(np.int32)
                cv2.polylines(image, list(points), False, colour, thickness, cv2.LINE_AA, 4)

    def _leaves(
        self,
        image: NDArray[np.uint8],
        u: NDArray[np.float32],
        v: NDArray[np.float32],
        z: NDArray[np.float32],
        angles: NDArray[np.float64],
        size: float,
        time_s: float,
    ) -> None:
        far_first = np.argsort(-z, kind="stable")
        turn, tumble = angles[far_first].T
        radius = self._camera.focal_px * size / 2 / z[far_first]
        around = _LOBES + turn[:, None] + 2.0 * time_s
        flat = np.abs(np.cos(tumble + 4.0 * time_s))
        reach = radius[:, None] * _LOBE_REACH
        x = u[far_first, None] + reach * np.cos(around)
        y = v[far_first, None] + reach * flat[:, None] * np.sin(around)
        outlines = np.round(16 * np.stack([x, y], axis=2)).astype(np.int32)
        for outline, ripe in zip(outlines, turn < math.pi, strict=True):
            colour = (186, 104, 34) if ripe else (156, 62, 34)
            cv2.fillPoly(image, [outline], colour, cv2.LINE_AA, 4)
