"""A flight in which another pilot takes over from the landing system at a given time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from pytest_garl.landing_system import (
    Abort,
    Airframe,
    AttitudeSetpoint,
    Command,
    Mission,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VehicleState,
    VelocitySetpoint,
    airframe_of,
)
from pytest_garl.simulation.physics.flight_control import FlightControl
from pytest_garl.simulation.physics.vehicle import Motion, Quaternion, Vector, vehicle_model
from pytest_garl.simulation.system_under_test.descent import descend
from pytest_garl.simulation.system_under_test.ground_truth import PilotWrapper

CRUISE_M = 10.0
"""Height to which the blind pilot continues a climb."""
ABOVE_MARKER_M = 1.5
"""Within this horizontal distance of the marker's centre the blind pilot descends: the marker's
side."""
CROSSING_MPS = 2.0
DESCENT_MPS = 1.0
"""Speeds of the blind pilot: those of the reference pilot's descent, and twice that across."""
CLIMBING_MPS = 0.3
"""A UAV that climbs faster than this is taking off."""
Pilot = Literal["escape", "stop", "hold", "blind"]
_ROUNDING_S = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """A velocity (x, y, z) that is commanded for a time."""

    velocity_mps: tuple[float, float, float]
    duration_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Takeover:
    """Who flies in place of the landing system from ``from_s`` on.

    "escape" flies the legs and hovers after them; "stop" switches the motors off; "hold" repeats
    the landing system's last command; "blind" goes on to the marker and down, and knows of nothing
    else.  The first command is the one
    that takes effect at ``from_s`` or just after it.  From ``until_s`` on the pilot gives up, which
    ends the flight.
    """

    pilot: Pilot
    from_s: float
    until_s: float
    legs: tuple[Leg, ...] = ()
    marker_m: tuple[float, float] = (0.0, 0.0)


def with_takeover(system: Callable[[], Any], takeover: Takeover) -> Callable[[], Any]:
    """Return what makes a landing system that another pilot replaces during the flight."""
    return _Maker(system, takeover)


class _Maker:
    """Makes the landing system; ``airframe`` is read before, as from a class."""

    def __init__(self, system: Callable[[], Any], takeover: Takeover) -> None:
        self._system, self._takeover = system, takeover
        self.airframe: Airframe = airframe_of(system)

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the landing system's class."""
        if name == "_system":
            raise AttributeError(name)
        return getattr(self._system, name)

    def __call__(self) -> TakenOver:
        return TakenOver(self._system(), self._takeover, self.airframe)


class TakenOver(PilotWrapper):
    """A landing system until a time; from then on another pilot flies.

    Until then every call reaches the landing system as it would alone, so that the flight is the
    same to the byte.
    """

    def __init__(self, inner: Any, takeover: Takeover, airframe: Airframe) -> None:
        self.wrapped, self._takeover = inner, takeover
        self._latency_s = airframe.latency_s
        self._control_dt_s = 1.0 / airframe.control_rate_hz if airframe.control_rate_hz else 0.0
        self._control = FlightControl(vehicle_model(airframe))
        self._last: Command = VelocitySetpoint(velocity_mps=(0.0, 0.0, 0.0))
        self._yaw_rad: float | None = None
        self._height_m: float | None = None

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the landing system, such as ``needs_camera``."""
        if name == "wrapped":
            raise AttributeError(name)
        return getattr(self.wrapped, name)

    def reset(self, mission: Mission) -> None:
        """Reset the landing system."""
        self.wrapped.reset(mission)

    def step(self, observation: Observation) -> Command:
        """Return the command of who flies when it takes effect."""
        effect_s = observation.time_s + self._latency_s
        if effect_s < self._takeover.from_s - _ROUNDING_S:
            command: Command = self.wrapped.step(observation)
            self._remember(command)
            return command
        x, y, z = (float(value) for value in observation.position_m)
        vx, vy, vz = (float(value) for value in observation.velocity_mps)
        attitude = _quaternion(observation.attitude)
        return self._command(effect_s, (x, y, z), (vx, vy, vz), attitude)

    def control(self, state: VehicleState) -> MotorThrusts:
        """Return the thrusts of who flies; the other pilot uses the simulated flight control."""
        held = self._takeover.pilot == "hold" and state.time_s < self._takeover.until_s
        if held or state.time_s < self._takeover.from_s - _ROUNDING_S:
            thrusts: MotorThrusts = self.wrapped.control(state)
            return thrusts
        position, velocity = _vector(state.position_m), _vector(state.velocity_mps)
        attitude = _quaternion(state.attitude)
        command = self._command(state.time_s, position, velocity, attitude)
        self._control.remember_yaw(command)
        motion = Motion(position, velocity, attitude, _vector(state.angular_velocity_radps))
        return MotorThrusts(newtons=self._control.thrusts(motion, command, self._control_dt_s))

    def _command(
        self, time_s: float, position: Vector, velocity: Vector, attitude: Quaternion
    ) -> Command:
        takeover = self._takeover
        if time_s >= takeover.until_s - _ROUNDING_S:
            return Abort()
        if takeover.pilot == "hold":
            return self._last
        if takeover.pilot == "stop":
            # Towards the present attitude, so that no motor runs to turn the UAV.
            return AttitudeSetpoint(attitude=attitude, thrust=0.0)
        if takeover.pilot == "blind":
            return self._blind(position, velocity)
        return VelocitySetpoint(
            velocity_mps=velocity_of(takeover.legs, time_s - takeover.from_s), yaw_rad=self._yaw_rad
        )

    def _blind(self, position: Vector, velocity: Vector) -> Command:
        """Continue to the marker at the present height, or at cruise height from a climb; descend.

        The pilot sees no object.
        """
        goal = self._takeover.marker_m
        if math.dist(goal, position[:2]) < ABOVE_MARKER_M:
            return descend(goal, position, DESCENT_MPS)
        if self._height_m is None:
            self._height_m = CRUISE_M if velocity[2] > CLIMBING_MPS else position[2]
        return PositionSetpoint(
            position_m=(*goal, self._height_m), yaw_rad=self._yaw_rad, speed_mps=CROSSING_MPS
        )

    def _remember(self, command: Command) -> None:
        self._last = command
        if isinstance(command, PositionSetpoint | VelocitySetpoint):
            if command.yaw_rad is not None:
                self._yaw_rad = command.yaw_rad
        elif isinstance(command, AttitudeSetpoint):
            self._control.remember_yaw(command)


def velocity_of(legs: tuple[Leg, ...], elapsed_s: float) -> Vector:
    """Return the velocity of the leg at a time after the takeover; zero after the last."""
    for leg in legs:
        if elapsed_s < leg.duration_s - _ROUNDING_S:
            return leg.velocity_mps
        elapsed_s -= leg.duration_s
    return 0.0, 0.0, 0.0


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _quaternion(values: Any) -> Quaternion:
    x, y, z, w = (float(value) for value in values)
    return x, y, z, w
