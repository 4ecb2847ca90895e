"""Faults of control: speeds, integrators, limits of tilt, the end of a landing."""

from __future__ import annotations

import dataclasses

from pytest_garl import AttitudeSetpoint, Command, Mission, Observation, PositionSetpoint
from studies.faults.control import ControlSystem, Parameters, Vector
from studies.faults.track import Place

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


class WindUp(ControlSystem):
    """Integrates the offset from its goal without a limit, from the take-off on.

    The report: windup before the touchdown tips the copter over.
    """

    GAIN = 0.12

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        super().reset(mission)
        self.integral = (0.0, 0.0)

    def centring(self, offset_m: Place) -> Place:
        """Add the integral to the velocity."""
        step_s = 1 / self.airframe.camera.rate_hz
        x, y = (
            total + self.GAIN * step_s * each
            for total, each in zip(self.integral, offset_m, strict=True)
        )
        self.integral = (x, y)
        vx, vy = super().centring(offset_m)
        return vx + x, vy + y


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


class StallOff(ControlSystem):
    """Stops the motors below 2 m once the descent has stalled for 0.4 s.

    The report: a land detector takes a slow descent with low throttle for the ground.
    """

    STALLED_MPS, STALLED_FRAMES, BELOW_M = 0.1, 4, 2.0

    def reset(self, mission: Mission) -> None:
        """Prepare for one flight."""
        super().reset(mission)
        self.stalled = 0

    def step(self, observation: Observation) -> Command:
        """Count frames without descent."""
        command = super().step(observation)
        low = self.phase == "commit" and float(observation.position_m[2]) < self.BELOW_M
        stalls = abs(float(observation.velocity_mps[2])) < self.STALLED_MPS
        self.stalled = self.stalled + 1 if low and stalls else 0
        if self.stalled >= self.STALLED_FRAMES:
            return AttitudeSetpoint(attitude=(0.0, 0.0, 0.0, 1.0), thrust=0.0)
        return command
