"""TPHYolo-MLS: the learned detector, the decision module, simple control; no obstacle avoidance."""

from __future__ import annotations

from landing_systems.modules.control_simple import SimpleControl
from landing_systems.modules.decision import DecisionModule
from landing_systems.modules.detection_tphyolo.detector import TphYoloDetector
from pytest_garl import Airframe, Command, Diagnostics, Mission, Observation


class TphYoloLandingSystem:
    """The second row of the paper's table of landing systems."""

    airframe = Airframe()

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self._detector = TphYoloDetector(mission)
        self._decision = DecisionModule(mission)
        self._control = SimpleControl()

    def step(self, observation: Observation) -> Command:
        """See, decide, command."""
        seen = self._detector.detect(observation)
        x, y, z = (float(value) for value in observation.position_m)
        decision = self._decision.decide(observation.time_s, (x, y, z), seen)
        target = decision.target_m
        diagnostics = Diagnostics(
            phase=decision.phase,
            detections=seen,
            target_m=(*target, 0.0) if target else None,
            note=decision.note,
        )
        return self._control.command(decision, (x, y, z), diagnostics)
