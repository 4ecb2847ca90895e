"""TPHYolo-MLS: the learned detector, the decision module, simple control; no obstacle avoidance."""

from __future__ import annotations

from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector
from landing_systems.modules.plain_landing import PlainLandingSystem
from pytest_garl import Mission


class TphYoloLandingSystem(PlainLandingSystem):
    """The second row of the paper's table of landing systems."""

    def detector(self, mission: Mission) -> TphYoloDetector:
        """Return the detector for one flight."""
        return TphYoloDetector(mission)
