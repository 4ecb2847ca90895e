"""Faults of geometry: frames, headings, tilt and the turn of the marker."""

from __future__ import annotations

import dataclasses
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.faults.control import ControlSystem
from lab.faults.eyes import Eyes
from pytest_garl import Detection, Observation


def heading_of(attitude: NDArray[np.float64]) -> float:
    """Return the heading of an attitude, rad."""
    x, y, z, w = (float(value) for value in attitude)
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def turned(observation: Observation, by_rad: float) -> Observation:
    """Return the observation as if the heading were another."""
    x, y, z, w = (float(value) for value in observation.attitude)
    sin, cos = math.sin(by_rad / 2), math.cos(by_rad / 2)
    # The turn about the vertical, after the attitude.
    other = np.array([cos * x - sin * y, cos * y + sin * x, cos * z + sin * w, cos * w - sin * z])
    return dataclasses.replace(observation, attitude=other)


class YawSignEyes(Eyes):
    """Eyes that turn offsets by the heading's negative."""

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Place markers with the sign of the heading reversed."""
        return super().detect(turned(observation, -2 * heading_of(observation.attitude)))


class YawSign(ControlSystem):
    """Turns the marker's offset from the body to the world by the negative heading.

    The report: landing targets in a level body frame are rotated with the wrong sign, so that the
    UAV diverges unless it faces the frame's axis.
    """

    eyes_of = YawSignEyes


class FoldedYawEyes(Eyes):
    """Eyes that read headings between 0 and 180 degrees only."""

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Place markers with headings below zero turned by half a turn."""
        by = math.pi if heading_of(observation.attitude) < math.radians(-5) else 0.0
        return super().detect(turned(observation, by))


class FoldedYaw(ControlSystem):
    """Folds headings beyond 180 degrees back by half a turn.

    The report: a conversion from quaternions clamps the first Euler angle to 0 to 180 degrees.  It
    wraps small negative headings, which noise gives a UAV that faces the axis, correctly.
    """

    eyes_of = FoldedYawEyes


class DiagonalEyes(Eyes):
    """Eyes that expect a marker whose sides are along those of the picture."""

    LEAST_FILL = 0.505

    def accepts(self, found: Detection, observation: Observation) -> bool:
        """Refuse a marker that fills too little of its upright box."""
        corners = np.array(found.corners_px, np.float32)
        width, height = np.ptp(corners, axis=0)
        fill = cv2.contourArea(corners) / (float(width) * float(height))
        return fill > self.LEAST_FILL and super().accepts(found, observation)


class Diagonal(ControlSystem):
    """Refuses markers that lie diagonally in the picture, as shapes that are no squares.

    The report: markers that are turned by 30 to 60 degrees are measured wrongly.
    """

    eyes_of = DiagonalEyes
