"""A pilot that knows where everything is.

It shows that a scenario can be landed in before the scenario counts against a landing system.
"""

from __future__ import annotations

import math

from pytest_garl.landing_system import (
    Abort,
    Airframe,
    Command,
    Mission,
    Observation,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.simulation.system_under_test.descent import centring_velocity, descend
from pytest_garl.simulation.system_under_test.ground_truth import Truth, TruthPilot

CRUISE_M = 10.0
CRUISE_MPS = 4.0
CENTRED_M = 0.10
"""The pilot ends its way across at this distance from the marker's centre."""
DESCENT_MPS = 1.0
LOOK_AHEAD_S = 3.0
CLEARANCE_M = 0.75
"""Half of the UAV and a quarter of a metre, beyond an object's own radius."""
PATIENCE_S = 45.0
"""The pilot waits this long above a marker that is not free, three times the time to come down: an
object on the marker keeps any UAV from landing, but makes none collide."""
ABORT_TAKES_S = 10.0


class ReferencePilot(TruthPilot):
    """Flies above everything to the true marker and descends while its column stays clear."""

    airframe = Airframe(latency_s=0.0)
    needs_camera = False

    def reset(self, mission: Mission) -> None:
        """Remember the mission; the truth comes before each step."""
        self._mission = mission
        self._truth: Truth | None = None
        self._arrived_s: float | None = None

    def observe_truth(self, truth: Truth) -> None:
        """Store the ground truth."""
        self._truth = truth

    def step(self, observation: Observation) -> Command:
        """Climb, cross, wait for a clear column, descend; or give up."""
        truth = self._truth
        x, y, z = (float(value) for value in observation.position_m)
        if truth is None:
            return PositionSetpoint(position_m=(x, y, CRUISE_M))
        goal = truth.marker_m
        offset = math.dist((x, y), goal)
        if self._arrived_s is None:
            if z < CRUISE_M - 1.0:
                home_x, home_y, _ = self._mission.home_m
                return PositionSetpoint(position_m=(home_x, home_y, CRUISE_M))
            if offset < CENTRED_M:
                self._arrived_s = observation.time_s
            return PositionSetpoint(position_m=(*goal, CRUISE_M), speed_mps=CRUISE_MPS)
        if self._blocked(truth, z):
            last = self._mission.time_limit_s - ABORT_TAKES_S
            if observation.time_s > min(self._arrived_s + PATIENCE_S, last):
                return Abort()
            return VelocitySetpoint(velocity_mps=(*centring_velocity(goal, (x, y)), 1.0))
        return descend(goal, (x, y, z), DESCENT_MPS)

    def _blocked(self, truth: Truth, height_m: float) -> bool:
        """Whether an object is in the column below, or will be within three seconds."""
        for item in truth.objects:
            top = item.position_m[2] + item.type.height_m
            reach = item.type.radius_m + CLEARANCE_M
            if height_m > top + 4.0:
                continue
            for step in range(7):
                ahead = LOOK_AHEAD_S * step / 6
                px = item.position_m[0] + ahead * item.velocity_mps[0]
                py = item.position_m[1] + ahead * item.velocity_mps[1]
                if math.dist((px, py), truth.marker_m) < reach:
                    return True
        return False
