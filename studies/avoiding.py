"""OpenCV-MLS that climbs away from obstacles in its depth image; flown by two studies.

``studies.adversary`` and ``studies.team`` measure learned NPC policies against it, because the
policies were trained against another avoiding UAV: the surrogate's, which avoids by geometry.
"""

from __future__ import annotations

import numpy as np

from landing_systems.modules.control_simple import SimpleControl
from landing_systems.modules.decision import DecisionModule
from landing_systems.modules.detection_opencv import OpenCvDetector
from landing_systems.modules.movement_watch import MovementWatch
from pytest_garl import (
    Airframe,
    Command,
    Diagnostics,
    Mission,
    Observation,
    VelocitySetpoint,
)

CLIMB_MPS = 1.5
CLEAR_S = 1.0
"""It climbs until nothing has moved below for this long."""


class AvoidingLandingSystem:
    """Lands like OpenCV-MLS, and climbs while something moves near the column below."""

    airframe = Airframe()

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        self._mission = mission
        self._detector = OpenCvDetector(mission)
        self._decision = DecisionModule(mission)
        self._control = SimpleControl()
        self._watch = MovementWatch(mission)
        self._moved_at = -np.inf

    def step(self, observation: Observation) -> Command:
        """Land, or climb while something moves below."""
        seen = self._detector.detect(observation)
        x, y, z = (float(value) for value in observation.position_m)
        now = observation.time_s
        decision = self._decision.decide(now, (x, y, z), seen)
        if self._watch.in_the_way(observation):
            self._moved_at = now
        target = decision.target_m
        avoids = now - self._moved_at < CLEAR_S and decision.phase not in ("take-off", "abort")
        diagnostics = Diagnostics(
            phase="avoid" if avoids else decision.phase,
            detections=seen,
            target_m=(*target, 0.0) if target else None,
            note="something moves below" if avoids else decision.note,
        )
        if not avoids:
            return self._control.command(decision, (x, y, z), diagnostics)
        self._decision.interrupt()
        climb = CLIMB_MPS if z < self._mission.search_altitude_m else 0.0
        return VelocitySetpoint(velocity_mps=(0.0, 0.0, climb), diagnostics=diagnostics)
