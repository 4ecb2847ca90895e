"""Common parts of OpenCV-MLS and TPHYolo-MLS, which differ only in the detector."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

from landing_systems.modules.control_simple import SimpleControl
from landing_systems.modules.decision import DecisionModule
from pytest_garl import Airframe, Command, Detection, Mission, Observation


class Detector(Protocol):
    """Finds markers in a frame and places them in the world."""

    def detect(self, observation: Observation) -> tuple[Detection, ...]:
        """Return all markers in the frame whose pose is plausible."""


class PlainLandingSystem(ABC):
    """A detector, the decision module, simple control; no obstacle avoidance."""

    airframe = Airframe()

    @abstractmethod
    def detector(self, mission: Mission) -> Detector:
        """Return the detector for one flight."""

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self._detector = self.detector(mission)
        self._decision = DecisionModule(mission)
        self._control = SimpleControl()

    def step(self, observation: Observation) -> Command:
        """See, decide, command."""
        seen = self._detector.detect(observation)
        x, y, z = (float(value) for value in observation.position_m)
        decision = self._decision.decide(observation.time_s, (x, y, z), seen)
        return self._control.command(decision, (x, y, z), decision.diagnostics(seen))
