"""One picture of the camera: colours, depth, and which body each pixel shows."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import MarkerView


class Frame:
    """One picture: RGB uint8 (H, W, 3), planar depth float32 (H, W), segmentation int32 (H, W).

    A ray that meets nothing has depth 100 and segment -1.  ``pixels`` is the
    number of pixels of each segment; it does not count the ground, segment 0.  ``image`` is
    painted on first access, and does not depend on the time of that access.  ``marker`` says how
    the frame shows the marker, None where it does not; it needs no picture.  ``marker_area_px`` is
    the projected area of the marker, clipped to the frame, with nothing in front.
    ``measured_depth_m`` is the depth as the depth camera measures it, 0 where it measures nothing.
    """

    __slots__ = (
        "_image",
        "_marker",
        "_marker_area_px",
        "_paint",
        "depth_m",
        "measured_depth_m",
        "pixels",
        "segmentation",
    )

    def __init__(
        self,
        *,
        paint: Callable[[], NDArray[np.uint8]],
        marker: Callable[[], MarkerView | None],
        marker_area_px: Callable[[], float],
        depth_m: NDArray[np.float32],
        segmentation: NDArray[np.int32],
        pixels: NDArray[np.intp],
    ) -> None:
        self._paint, self._marker, self._marker_area_px = paint, marker, marker_area_px
        self._image: NDArray[np.uint8] | None = None
        self.depth_m = self.measured_depth_m = depth_m
        self.segmentation = segmentation
        self.pixels = pixels

    @property
    def image(self) -> NDArray[np.uint8]:
        """The picture as the camera's sensor returns it, RGB uint8 (H, W, 3)."""
        if self._image is None:
            self._image = self._paint()
        return self._image

    @property
    def marker(self) -> MarkerView | None:
        """How the frame shows the marker, computed at each access."""
        return self._marker()

    @property
    def marker_area_px(self) -> float:
        """Projected area of the marker, computed at each access."""
        return self._marker_area_px()


@functools.cache
def blank_frame(height_px: int, width_px: int) -> Frame:
    """Return a black frame without depth, for systems that use no camera."""
    shape = height_px, width_px
    return Frame(
        paint=lambda: np.zeros((*shape, 3), np.uint8),
        marker=lambda: None,
        marker_area_px=lambda: 0.0,
        depth_m=np.zeros(shape, np.float32),
        segmentation=np.zeros(shape, np.int32),
        pixels=np.zeros(2, np.intp),
    )
