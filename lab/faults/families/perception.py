"""Faults of perception: what the picture must be like."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np

from lab.faults.control import ControlSystem
from lab.faults.eyes import Eyes
from pytest_garl import Detection, Observation


class FixedThresholdEyes(Eyes):
    """Eyes that make the picture black and white at one grey."""

    THRESHOLD = 110

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Look at a picture of two greys."""
        grey = cv2.cvtColor(observation.image, cv2.COLOR_RGB2GRAY)
        _, binary = cv2.threshold(grey, self.THRESHOLD, 255, cv2.THRESH_BINARY)
        image = np.asarray(cv2.cvtColor(binary, cv2.COLOR_GRAY2RGB), np.uint8)
        return super().detect(dataclasses.replace(observation, image=image))


class FixedThreshold(ControlSystem):
    """Binarises pictures at a fixed grey, which was set by day.

    The report: markers are not found unless the threshold is set by hand for the light.
    """

    eyes_of = FixedThresholdEyes


class GainEyes(Eyes):
    """Eyes that scale pictures to a wanted brightness."""

    WANTED = 110.0

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Divide by the picture's mean."""
        mean = float(observation.image.mean())
        gain = self.WANTED / mean
        image = np.clip(observation.image * gain, 0, 255).astype(np.uint8)
        return super().detect(dataclasses.replace(observation, image=image))


class Gain(ControlSystem):
    """Divides by the brightness of the picture, also if that is black.

    The report: a division by zero in the dark.
    """

    eyes_of = GainEyes
