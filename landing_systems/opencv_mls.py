"""OpenCV-MLS: ArUco detection, the decision module, simple control; no obstacle avoidance."""

from __future__ import annotations

from landing_systems.modules.detection_opencv import OpenCvDetector
from landing_systems.modules.plain_landing import PlainLandingSystem
from pytest_garl import Mission


class OpenCvLandingSystem(PlainLandingSystem):
    """The first row of the paper's table of landing systems."""

    def detector(self, mission: Mission) -> OpenCvDetector:
        """Return the detector for one flight."""
        return OpenCvDetector(mission)
