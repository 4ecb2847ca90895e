"""Faults of control: speeds, integrators, limits of tilt, the end of a landing."""

from __future__ import annotations

import dataclasses

from lab.faults.control import ControlSystem, Parameters, Vector
from lab.faults.track import Place
from pytest_garl import AttitudeSetpoint, Command, Observation, PositionSetpoint

CONTROL = Parameters()


class FastTouchdown(ControlSystem):
    """Descends at 2.4 m/s until the altimeter says 1 m.

    The report: the speed of a precision landing is not reduced without a rangefinder.
    """

    parameters = dataclasses.replace(CONTROL, land_mps=2.4, commit_offset_m=0.4)
    SLOW_BELOW_M = 0.9

    def sink(self, at: Vector, target: Place, rate_mps: float) -> Command:
        """Slow down late."""
        slow = at[2] < self.SLOW_BELOW_M
        return super().sink(at, target, min(rate_mps, 0.4) if slow else rate_mps)


class LowTilt(ControlSystem):
    """Limits the tilt to 5 degrees.

    The report: a limit of the tilt that is too low lets the vehicle drift with the wind.
    """

    TILT_RAD = 0.09

    def go(self, place: Place, height_m: float, speed_mps: float) -> Command:
        """Fly to a place with little tilt."""
        return PositionSetpoint(
            position_m=(*place, height_m),
            speed_mps=speed_mps,
            yaw_rad=None,
            tilt_rad=self.TILT_RAD,
        )


class MotorsOff(ControlSystem):
    """Stops the motors where the altimeter says that it is on the ground.

    The report: a height of zero or less stops all motors, also in the air.
    """

    STANDS_AT_M = 0.12

    def step(self, observation: Observation) -> Command:
        """Stop the motors at the ground's height."""
        command = super().step(observation)
        if self.phase == "commit" and float(observation.position_m[2]) < self.STANDS_AT_M:
            return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=0.0)
        return command
