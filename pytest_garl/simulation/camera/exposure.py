"""The way of light to the sensor: dirt on the lens, and the movement while a picture is exposed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.camera.meshes import rotation_matrix
from pytest_garl.simulation.camera.projection import NEAR_M, View
from pytest_garl.simulation.randomness import generator

OPACITY = 0.9
SCATTERED = 0.5
"""Dirt takes this share of the light in the middle of a patch, and scatters stray light to the
sensor, this share of the scene's mean colour for all light that it takes. The form is that of Gu et
al. 2009 (Removing image artifacts due to dirty camera lenses and thin occluders): both vary slowly
over the picture, as dirt on the lens is far out of focus. The figures are engineering estimates."""
PATCH_SHARE = 0.04
"""Scale of a patch as a share of the picture's width: engineering estimate."""
SOFT = 0.5
"""Half the width of a patch's edge, in standard deviations of the field that makes the patches."""
_CELLS = 80
_LEAST_PX = 0.25
_MOST_STEPS = 16
"""A picture is the mean of one picture per pixel of the blur, and of this many at most."""

Array = NDArray[np.float32]
Matrix = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Movement:
    """How a camera moves: velocity in m/s and angular velocity in rad/s in the world's axes."""

    velocity_mps: Vector = (0.0, 0.0, 0.0)
    spin_radps: Vector = (0.0, 0.0, 0.0)


STILL = Movement()


class Optics:
    """The lens and the exposure time of one flight's camera."""

    def __init__(self, scenario: Scenario, camera: Camera) -> None:
        # No picture is exposed for longer than the time to the next one.
        self._exposure_s = min(scenario["camera.exposure_ms"] / 1000, 1 / camera.rate_hz)
        share = scenario["camera.dirt_percent"] / 100
        self._dirt = _dirt(scenario.seed, camera, share) if share > 0 else None

    def exposure(self, view: View, movement: Movement) -> Exposure:
        """Return what happens to the picture that is exposed around the moment of a view."""
        return Exposure(view=view, movement=movement, time_s=self._exposure_s, dirt=self._dirt)


@dataclass(frozen=True, kw_only=True, eq=False)
class Exposure:
    """What the lens and the movement do to one picture; ``time_s`` is centred on the view."""

    view: View
    movement: Movement
    time_s: float
    dirt: NDArray[np.uint8] | None

    def blur_px(self, place_px: NDArray[Any]) -> float:
        """Return how many pixels the ground at a pixel, (2,), moves during the exposure."""
        if not self._moves:
            return 0.0
        first, last = (
            _through(np.linalg.inv(self._before(part * self.time_s)), place_px)
            for part in (-0.5, 0.5)
        )
        return math.dist(first, last)

    def clear(self, row: NDArray[np.intp], column: NDArray[np.intp]) -> Array | None:
        """Return the share of light, (n,), that passes at n pixels; None for a clean lens."""
        if self.dirt is None:
            return None
        return np.asarray(1 - self.dirt[row, column] / np.float32(255), np.float32)

    @property
    def _moves(self) -> bool:
        return self.time_s > 0 and self.movement != STILL and self.view.eye[2] > NEAR_M

    @cached_property
    def _pixel_of_ground(self) -> Matrix:
        return np.asarray(np.linalg.inv(self.view.ground_of_pixel), np.float64)

    def _before(self, seconds: float) -> Matrix:
        """Return the map from pixels at a time of the exposure to the same ground in the view.

        All is taken to lie on the ground, as the marker does.
        """
        x, y, z = (each * seconds for each in self.movement.spin_radps)
        angle = math.sqrt(x * x + y * y + z * z)
        scale = math.sin(angle / 2) / angle if angle > 0 else 0.0
        turn = rotation_matrix((x * scale, y * scale, z * scale, math.cos(angle / 2)))
        eye = self.view.eye + np.array(self.movement.velocity_mps) * seconds
        eye[2] = max(NEAR_M, eye[2])
        then = View(camera=self.view.camera, eye=eye, axes=self.view.axes @ turn.T)
        return self._pixel_of_ground @ then.ground_of_pixel

    def moved(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a sharp picture of the view, (h, w, 3), as the movement blurs it."""
        if not self._moves:
            return image
        height, width = image.shape[:2]
        middle = np.array([(width - 1) / 2, (height - 1) / 2], np.float32)
        corners = np.array([[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]])
        length = max(self.blur_px(place) for place in (middle, *corners.astype(np.float32)))
        if length < _LEAST_PX:
            return image
        steps = min(_MOST_STEPS, max(2, math.ceil(length)))
        # Four channels: warpPerspective is 2.5 times as fast as with three.
        wide = cv2.cvtColor(image, cv2.COLOR_RGB2RGBA)
        total = np.zeros((height, width, 4), np.float32)
        for index in range(steps):
            then = self._before(((index + 0.5) / steps - 0.5) * self.time_s)
            flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            part = cv2.warpPerspective(
                wide, then, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE
            )
            cv2.accumulate(part, total)
        mean = cv2.convertScaleAbs(total, alpha=1 / steps)
        return np.asarray(cv2.cvtColor(mean, cv2.COLOR_RGBA2RGB), np.uint8)

    def soiled(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a picture, (h, w, 3), as a dirty lens lets it through."""
        if self.dirt is None:
            return image
        hidden = cv2.cvtColor(self.dirt, cv2.COLOR_GRAY2RGB)
        stray = np.array(cv2.mean(image)[:3]) * SCATTERED
        table = np.round(np.arange(256)[:, None] / 255 * stray).astype(np.uint8)
        through = cv2.multiply(image, cv2.bitwise_not(hidden), None, 1 / 255)
        soiled = cv2.add(through, cv2.LUT(hidden, table.reshape(1, 256, 3)))
        return np.asarray(soiled, np.uint8)


def _dirt(seed: int, camera: Camera, share: float) -> NDArray[np.uint8]:
    """Return the share of light, of 255, that the lens takes at each pixel.

    The patches' outlines, where half of the opacity is reached, hold ``share`` of the picture; the
    patches of a seed grow with the share.
    """
    sigma = PATCH_SHARE * _CELLS
    edge = math.ceil(4 * sigma)
    rows = max(4, round(_CELLS * camera.height_px / camera.width_px))
    noise = generator(seed, "dirt").standard_normal(
        (rows + 2 * edge, _CELLS + 2 * edge), dtype=np.float32
    )
    smooth = cv2.GaussianBlur(noise, (2 * edge + 1, 2 * edge + 1), sigma)[edge:-edge, edge:-edge]
    size = camera.width_px, camera.height_px
    field = cv2.resize(smooth / smooth.std(), size, interpolation=cv2.INTER_LINEAR)
    above = (field - np.quantile(field, 1 - share)) / (2 * SOFT)
    taken = 255 * OPACITY * np.clip(0.5 + above, 0, 1)
    return np.asarray(np.round(taken), dtype=np.uint8)


def _through(matrix: NDArray[Any], place_px: NDArray[Any]) -> tuple[float, float]:
    x, y, scale = matrix @ (float(place_px[0]), float(place_px[1]), 1.0)
    return float(x / scale), float(y / scale)
