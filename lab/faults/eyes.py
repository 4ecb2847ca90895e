"""The eyes of the control: which markers of a frame are taken for the landing pad."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from landing_systems.modules.detection_opencv import OpenCvDetector
from pytest_garl import Detection, Mission, Observation

CELL_PX = 4
"""Pixels per module of a marker that is straightened to look at its margin."""
WHITE_SHARE = 0.55
"""A margin is white if its median grey lies this far from the border's black to the bits' white."""
STRIDE_PX = 8


class Eyes(OpenCvDetector):
    """Finds markers, and accepts those that can be the pad."""

    def __init__(self, mission: Mission) -> None:
        super().__init__(mission)
        self.mission = mission
        self._last: NDArray[np.uint8] | None = None

    def look(self, observation: Observation) -> tuple[Detection, ...]:
        """Return the accepted markers in a frame; none in one that was shown before."""
        if self.is_repeated(observation):
            return ()
        found = self.detect(observation)
        return tuple(each for each in found if self.accepts(each, observation))

    def is_repeated(self, observation: Observation) -> bool:
        """Whether the picture is the last one again: noise makes two pictures differ."""
        sample = np.array(observation.image[::STRIDE_PX, ::STRIDE_PX])
        repeated = self._last is not None and np.array_equal(sample, self._last)
        self._last = sample
        return repeated and bool(sample.any())

    def accepts(self, found: Detection, observation: Observation) -> bool:
        """Whether a marker has the wanted id and a white margin."""
        return found.marker_id == self.mission.marker_id and self.has_margin(
            found, observation.image
        )

    def has_margin(self, found: Detection, image: NDArray[np.uint8]) -> bool:
        """Whether white surrounds the marker; what lies beyond the frame counts for nothing."""
        grey = _straightened(found, np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)))
        border, bits, margin = _rings(grey)
        if not len(margin):
            return True
        black, white = float(np.median(border)), float(np.percentile(bits, 90))
        return float(np.median(margin)) > black + WHITE_SHARE * (white - black)


def _straightened(found: Detection, grey: NDArray[Any]) -> NDArray[Any]:
    """Return the marker and its margin as a square picture of nine modules; 0 beyond the frame."""
    side = 9 * CELL_PX
    low, high = CELL_PX - 0.5, side - CELL_PX - 0.5
    corners = np.array([[low, low], [high, low], [high, high], [low, high]], np.float32)
    turn = cv2.getPerspectiveTransform(np.array(found.corners_px, np.float32), corners)
    # Black pixels of the frame become 1, so that 0 is what lies beyond it.
    return np.asarray(cv2.warpPerspective(np.maximum(grey, 1), turn, (side, side)))


def _rings(grey: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return the pixels of the black border, of the bits and of the margin's outer half."""
    side = len(grey)
    index = np.minimum(np.arange(side), np.arange(side)[::-1])
    ring = np.minimum.outer(index, index)
    margin = grey[ring < CELL_PX // 2]
    border = grey[(ring >= CELL_PX + 1) & (ring < 2 * CELL_PX - 1)]
    return border, grey[ring >= 2 * CELL_PX], margin[margin > 0]
