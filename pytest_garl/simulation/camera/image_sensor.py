"""The image sensor: exposure under the light there is, and the noise that it costs."""

from __future__ import annotations

import hashlib
import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.weather import Conditions

FULL_LIGHT_LUX = 100_000.0
MAX_EXPOSURE_STEPS = 5.0
MAX_GAIN = 16.0
"""From 2 ms in full sun to 10 ms, beyond which a moving UAV blurs, then 24 dB of gain:
engineering estimate of a small machine-vision camera."""
NOISE_LEVELS = 1.2
"""In grey levels at unit gain, mostly shot noise, hence growing with the root of the gain:
engineering estimate of a small machine-vision sensor."""
_SPARE = 64


class Sensor:
    """Turns a picture in full light into what the sensor delivers.

    ``exposure`` is the factor by which a picture in full light gets darker, at most 1, and
    ``noise_levels`` the standard deviation of each channel of a pixel.
    """

    def __init__(self, camera: Camera, conditions: Conditions, rng: np.random.Generator) -> None:
        need = FULL_LIGHT_LUX / conditions.illuminance_lux
        gain = min(MAX_GAIN, max(1.0, need / MAX_EXPOSURE_STEPS))
        self.exposure = exposure = min(1.0, MAX_EXPOSURE_STEPS * MAX_GAIN / need)
        self.noise_levels = NOISE_LEVELS * gain**0.5
        # The sun is warm near the horizon: blue is scattered out of its light.
        low = max(0.0, min(1.0, 1.0 - conditions.sun[2] / 0.5))
        tint = (1.0, 1.0 - 0.08 * low, 1.0 - 0.22 * low)
        levels = np.arange(256)[None, :, None] * exposure * np.array(tint)[None, None, :]
        self._table = np.clip(levels, 0, 255).astype(np.uint8)
        self._neutral = bool(exposure == 1.0 and low == 0.0)
        shape = (camera.height_px + _SPARE, camera.width_px + _SPARE, 3)
        noise = rng.standard_normal(shape, dtype=np.float32) * NOISE_LEVELS * gain**0.5
        # Two pictures of bytes: adding signed noise to bytes is five times as slow.
        self._more = np.clip(np.round(noise), 0, 127).astype(np.uint8)
        self._less = np.clip(np.round(-noise), 0, 127).astype(np.uint8)
        self._salt = int(rng.integers(2**32))

    def expose(self, image: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Return the exposed picture, (h, w, 3), with its noise; ``image`` may be overwritten."""
        if not self._neutral:
            image = np.asarray(cv2.LUT(image, self._table), dtype=np.uint8)
        digest = hashlib.blake2b(struct.pack("<Id", self._salt, time_s), digest_size=2).digest()
        down, across = digest[0] % _SPARE, digest[1] % _SPARE
        height, width = image.shape[:2]
        here = np.s_[down : down + height, across : across + width]
        cv2.add(image, self._more[here], image)
        return np.asarray(cv2.subtract(image, self._less[here], image), dtype=np.uint8)
