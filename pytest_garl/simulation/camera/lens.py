"""A lens that distorts: pictures are drawn as a pinhole sees them, and then bent."""

from __future__ import annotations

import functools
import math
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.airframe import MOST_WIDENING
from pytest_garl.distortion import distorted, undistorted
from pytest_garl.errors import GarlError
from pytest_garl.landing_system import Camera

_MARGIN_PX = 2
_Number = TypeVar("_Number", np.float32, np.int32)


class Lens:
    """The lens of a camera; ``pinhole`` is the camera that sees all that it shows.

    Both have the same focal length.  Raises GarlError if the distortion folds back in the picture.
    """

    def __init__(self, camera: Camera) -> None:
        width, height, focal = camera.width_px, camera.height_px, camera.focal_px
        cx, cy = camera.centre_px
        rows, columns = np.mgrid[0:height, 0:width].reshape(2, -1)
        seen = undistorted(
            np.stack([(columns - cx) / focal, (rows - cy) / focal], axis=1), camera.distortion
        )
        if seen is None:
            raise GarlError(f"Camera.distortion = {camera.distortion} folds back in the picture")
        across, down = np.abs(seen).max(axis=0) * focal
        wide = 2 * (math.ceil(across) + _MARGIN_PX)
        high = 2 * (math.ceil(down) + _MARGIN_PX)
        self._camera = camera
        self.pinhole = Camera(
            width_px=min(wide, int(MOST_WIDENING * width)),
            height_px=min(high, int(MOST_WIDENING * height)),
            field_of_view_rad=2 * math.atan(wide / 2 / focal),
            rate_hz=camera.rate_hz,
            yaw_rad=camera.yaw_rad,
            tilt_rad=camera.tilt_rad,
            offset_m=camera.offset_m,
        )
        places = seen * focal + np.array(self.pinhole.centre_px)
        self._columns, self._rows = np.ascontiguousarray(
            places.T.reshape(2, height, width), np.float32
        )
        column, row = np.rint(places).astype(np.intp).T
        self._nearest = (row * self.pinhole.width_px + column).reshape(height, width)
        self.stretch = np.sqrt(1 + (seen**2).sum(axis=1)).reshape(height, width)
        """Length of each pixel's ray to the depth of 1, shape (H, W)."""

    def picture(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a picture of ``pinhole``, (h, w, 3), as the lens shows it, (H, W, 3)."""
        bent = cv2.remap(
            image, self._columns, self._rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(bent, np.uint8)

    def nearest(self, values: NDArray[_Number]) -> NDArray[_Number]:
        """Return the values (h, w) of the pixels of ``pinhole`` as the lens shows them, (H, W)."""
        found: NDArray[_Number] = values.ravel()[self._nearest]
        return found

    def shown(self, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return where the lens shows the pixels (n, 2) of ``pinhole``, shape (n, 2)."""
        if not len(pixels):
            return pixels
        focal = self._camera.focal_px
        places = (pixels.astype(np.float64) - self.pinhole.centre_px) / focal
        # Beyond what the picture shows the model may fold back.
        reach = np.array([self.pinhole.width_px, self.pinhole.height_px]) / 2 / focal
        beyond = np.maximum(1.0, (np.abs(places) / reach).max(axis=1))[:, None]
        bent = distorted(places / beyond, self._camera.distortion) * beyond
        return np.asarray(bent * focal + self._camera.centre_px, np.float32)


@functools.lru_cache(maxsize=4)
def lens_of(camera: Camera) -> Lens | None:
    """Return the camera's lens, None if it does not distort."""
    return Lens(camera) if camera.distortion else None
