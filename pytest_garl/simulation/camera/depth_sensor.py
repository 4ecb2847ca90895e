"""The depth camera: its reach in the air there is, and holes where it measures nothing."""

from __future__ import annotations

import math
import statistics

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.groups import NO_LIMIT_M
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.lens import lens_of
from pytest_garl.simulation.camera.weather import conditions_of
from pytest_garl.simulation.randomness import generator

PATCH_SHARE = 0.03
"""Scale of a hole's edge, as a share of the picture's width: engineering estimate. Stereo matching
fails on whole surfaces without texture or with a reflection, not on single pixels."""
PERSIST_S = 0.5
"""For this long a pattern of holes fades into the next: engineering estimate; a moving camera sees
reflections elsewhere after that, while a hole outlasts single frames."""
_CELLS = 80
"""Cells of the pattern across the picture: a hole is wider than a cell."""

Array = NDArray[np.float32]


class DepthSensor:
    """Turns true planar depth into what the depth camera measures; 0 where it measures nothing."""

    def __init__(self, scenario: Scenario, camera: Camera) -> None:
        self._seed = scenario.seed
        width, height = camera.width_px, camera.height_px
        (cx, cy), focal = camera.centre_px, camera.focal_px
        across = (np.arange(width, dtype=np.float32) - cx) / focal
        down = (np.arange(height, dtype=np.float32)[:, None] - cy) / focal
        self._stretch = np.sqrt(1 + across**2 + down**2)
        if lens := lens_of(camera):
            self._stretch = lens.stretch.astype(np.float32)
        self._size = width, height
        self._cells = max(4, round(_CELLS * height / width)), _CELLS
        share = scenario["depth.holes_percent"] / 100
        self._threshold = statistics.NormalDist().inv_cdf(share) if share > 0 else None
        self._patterns: dict[int, Array] = {}
        self.change(scenario)

    def change(self, scenario: Scenario) -> None:
        """Measure through the air of another environment from now on."""
        clear_m = scenario["depth.range_m"]
        self._limit_m: Array | None = None
        if clear_m < NO_LIMIT_M:
            reach = reach_m(clear_m, conditions_of(scenario).extinction_per_m)
            # The reach is the length of a ray, depth its part along the camera's axis.
            self._limit_m = (reach / self._stretch).astype(np.float32)

    def measured(self, depth_m: Array, time_s: float) -> Array:
        """Return what is measured at a time of the flight; the true depth stays as it is."""
        if self._limit_m is None and self._threshold is None:
            return depth_m
        depth = depth_m.copy()
        if self._limit_m is not None:
            depth[depth_m > self._limit_m] = 0.0
        if self._threshold is not None:
            depth[self._field(time_s) < self._threshold] = 0.0
        return depth

    def _field(self, time_s: float) -> Array:
        """Return a smooth field (H, W) with a standard normal distribution in each pixel."""
        epoch, share = divmod(time_s / PERSIST_S, 1.0)
        angle = share * math.pi / 2
        # Two independent fields, so that their blend has the same variance at every time.
        blend = math.cos(angle) * self._pattern(int(epoch))
        blend += math.sin(angle) * self._pattern(int(epoch) + 1)
        field = cv2.resize(blend, self._size, interpolation=cv2.INTER_NEAREST)
        return np.asarray(field, dtype=np.float32)

    def _pattern(self, epoch: int) -> Array:
        pattern = self._patterns.get(epoch)
        if pattern is None:
            self._patterns = {key: each for key, each in self._patterns.items() if key >= epoch - 1}
            sigma = PATCH_SHARE * _CELLS
            edge = math.ceil(4 * sigma)
            rows, columns = (each + 2 * edge for each in self._cells)
            rng = generator(self._seed, "depth", epoch)
            noise = rng.standard_normal((rows, columns), dtype=np.float32)
            smooth = cv2.GaussianBlur(noise, (2 * edge + 1, 2 * edge + 1), sigma)
            kernel = cv2.getGaussianKernel(2 * edge + 1, sigma)
            # White noise leaves the filter with the sum of the squared weights as its variance.
            scale = np.float32((kernel**2).sum())
            pattern = np.asarray(smooth[edge:-edge, edge:-edge] / scale, dtype=np.float32)
            self._patterns[epoch] = pattern
        return pattern


def reach_m(clear_m: float, extinction_per_m: float) -> float:
    """Return the reach in air with an extinction, of a sensor that reaches ``clear_m`` without it.

    What comes back falls with exp(-2 extinction R) / R^2 and is as weak at the reach as it is at
    ``clear_m`` in clear air (the lidar equation of a surface that fills the beam):
    R exp(extinction R) = clear_m, which Lambert's W solves.
    """
    if extinction_per_m <= 0:
        return clear_m
    x = extinction_per_m * clear_m
    w = math.log1p(x)
    for _ in range(8):  # Newton's method; from above it converges to the last digits by then
        w -= (w - x * math.exp(-w)) / (1 + w)
    return w / extinction_per_m
