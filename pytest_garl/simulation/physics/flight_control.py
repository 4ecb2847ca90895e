"""The simple flight control: a cascade from setpoints to motor thrusts.

A cascade like AirSim's simple_flight: position P, velocity PI, attitude P, rate P; but with an
integral on all axes of velocity; AirSim has it on the vertical axis only.
"""

from __future__ import annotations

import math

from pytest_garl.flight.thresholds import GRAVITY_MPS2
from pytest_garl.landing_system import (
    Abort,
    AttitudeSetpoint,
    Command,
    Land,
    PositionSetpoint,
    VelocitySetpoint,
)
from pytest_garl.simulation.physics.vehicle import (
    Motion,
    Quaternion,
    Thrusts,
    Vector,
    VehicleModel,
    mix,
)

POSITION_P = 1.0
VELOCITY_P = 2.2
VELOCITY_I = 0.6
ATTITUDE_P = 8.0
RATE_P = 22.0
YAW_RATE_P = 6.0
"""Bandwidths in 1/s, each loop a half to a quarter of the next inner one, the innermost close to
the motors' 20 1/s."""
MAX_TILT_RAD = math.radians(25)
NO_THRUST: Thrusts = (0.0, 0.0, 0.0, 0.0)
_MAX_SLOPE = math.tan(MAX_TILT_RAD)
MAX_ACCELERATION_MPS2 = 4.0
MAX_RATE_RADPS = 3.5
MAX_CLIMB_MPS = 5.0
MAX_DESCENT_MPS = 4.0
"""Climb and descent are the Matrice 100's ratings.  It may tilt 35 degrees; a landing controller
stays below that."""
MAX_INTEGRAL_MPS2 = 4.0
BRAKING_SHARE = 0.7
"""Share of a setpoint's acceleration limit with which the approach is planned.  The rest is for the
loop of the velocity, which follows the falling wanted speed 1 / VELOCITY_P seconds late;
``test_flight_control.py`` measures that the UAV does not overshoot."""
ABORT_CLIMB_MPS = 3.0
STANDING_AFTER_S = 0.35
"""PX4's documented time until ground contact counts, if a vehicle is commanded to descend and does
not move vertically; from there on its position control takes the thrust away."""
DESCENDS_MPS = 0.1
"""A command that wants less does not mean to land: half of what a setpoint of the position at
height 0 wants of a UAV on its feet."""


class FlightControl:
    """Turns the latest command into motor thrusts; one instance per flight."""

    def __init__(self, model: VehicleModel) -> None:
        self._model = model
        self._integral = [0.0, 0.0, 0.0]
        self._hold: Vector | None = None
        self._command: Command | None = None
        self._yaw_rad: float | None = None

    def remember_yaw(self, command: Command) -> None:
        """Keep the yaw of a command: ``Land``, ``Abort`` and a yaw of None hold the last one.

        Called for every command, also while a landing system controls the motors itself.
        """
        if isinstance(command, PositionSetpoint | VelocitySetpoint):
            if command.yaw_rad is not None:
                self._yaw_rad = command.yaw_rad
        elif isinstance(command, AttitudeSetpoint):
            self._yaw_rad = _yaw(command.attitude)

    def thrusts(
        self, motion: Motion, command: Command | None, dt_s: float, on_ground_s: float = 0.0
    ) -> Thrusts:
        """Return the wanted motor thrusts (front left, front right, rear right, rear left).

        ``on_ground_s`` is for how long the UAV has been back on the ground: one that stands there
        and shall descend gets no thrust.
        """
        if command is None:
            return NO_THRUST
        if isinstance(command, AttitudeSetpoint):
            thrust = command.thrust * 4 * self._model.max_thrust_n
            return self._thrusts_towards(
                motion, _z_axis(command.attitude), _yaw(command.attitude), thrust
            )
        if type(command) is not type(self._command):
            self._hold = motion.position_m
        self._command = command
        if self._yaw_rad is None:
            self._yaw_rad = _yaw(motion.attitude)
        wanted, yaw = self._wanted_velocity(motion, command, self._yaw_rad)
        if on_ground_s >= STANDING_AFTER_S and wanted[2] <= -DESCENDS_MPS:
            return NO_THRUST
        limit, steepest = None, _MAX_SLOPE
        if isinstance(command, PositionSetpoint):
            limit = command.acceleration_mps2
            if command.tilt_rad is not None:
                steepest = math.tan(command.tilt_rad)
        ax, ay, az = self._acceleration(motion, wanted, dt_s, limit)
        vertical = az + GRAVITY_MPS2
        if vertical < 2.0:
            vertical = 2.0
        tilt = math.hypot(ax, ay) / vertical
        scale = steepest / tilt if tilt > steepest else 1.0
        direction = _unit((ax * scale, ay * scale, vertical))
        x, y, _, _ = motion.attitude
        upright = 1 - 2 * (x * x + y * y)
        thrust = self._model.mass_kg * vertical / (0.5 if upright < 0.5 else upright)
        return self._thrusts_towards(motion, direction, yaw, thrust)

    def _wanted_velocity(
        self, motion: Motion, command: Command, held_rad: float
    ) -> tuple[Vector, float]:
        position = motion.position_m
        hold = self._hold or position
        if isinstance(command, PositionSetpoint | VelocitySetpoint):
            yaw = held_rad if command.yaw_rad is None else command.yaw_rad
        if isinstance(command, VelocitySetpoint):
            return command.velocity_mps, yaw
        if isinstance(command, PositionSetpoint):
            (ax, ay, az), (x, y, z) = command.position_m, position
            vx, vy, vz = POSITION_P * (ax - x), POSITION_P * (ay - y), POSITION_P * (az - z)
            length = math.sqrt(vx * vx + vy * vy + vz * vz)
            most = command.speed_mps
            if command.acceleration_mps2 is not None:
                most = min(most, _approach_mps(length / POSITION_P, command.acceleration_mps2))
            factor = most / length if length > most else 1.0
            return (vx * factor, vy * factor, vz * factor), yaw
        climb = ABORT_CLIMB_MPS if isinstance(command, Abort) else 0.0
        if isinstance(command, Land):
            climb = -command.speed_mps
        vx, vy = POSITION_P * (hold[0] - position[0]), POSITION_P * (hold[1] - position[1])
        return (vx, vy, climb), held_rad

    def _acceleration(
        self, motion: Motion, wanted: Vector, dt_s: float, limit: float | None
    ) -> Vector:
        (wx, wy, wz), (vx, vy, vz) = wanted, motion.velocity_mps
        climb = _bounded(wz, -MAX_DESCENT_MPS, MAX_CLIMB_MPS)
        ex, ey, ez = wx - vx, wy - vy, climb - vz
        mx = my = mz = MAX_ACCELERATION_MPS2
        if limit is not None:
            # The limit is that of the vector, so each axis has its share of it.
            length = math.sqrt(ex * ex + ey * ey + ez * ez) or 1.0
            mx, my, mz = (limit * abs(each) / length for each in (ex, ey, ez))
        return (
            self._axis_acceleration(0, ex, dt_s, mx),
            self._axis_acceleration(1, ey, dt_s, my),
            self._axis_acceleration(2, ez, dt_s, mz),
        )

    def _axis_acceleration(self, axis: int, error: float, dt_s: float, most: float) -> float:
        proportional = VELOCITY_P * error
        integral = self._integral[axis]
        # Integrating while the output is saturated would wind up and overshoot.
        if -most < proportional < most:
            total = integral + VELOCITY_I * error * dt_s
            integral = _bounded(total, -MAX_INTEGRAL_MPS2, MAX_INTEGRAL_MPS2)
            self._integral[axis] = integral
            return proportional + integral
        return _bounded(proportional, -most, most) + integral

    def _thrusts_towards(
        self, motion: Motion, direction: Vector, yaw_rad: float, thrust_n: float
    ) -> Thrusts:
        # The tilt error as a rotation vector in the body frame: z x wanted direction.
        wx, wy, _ = _to_body(motion.attitude, direction)
        yaw_error = math.remainder(yaw_rad - _yaw(motion.attitude), math.tau)
        roll = _bounded(-wy * ATTITUDE_P, -MAX_RATE_RADPS, MAX_RATE_RADPS)
        pitch = _bounded(wx * ATTITUDE_P, -MAX_RATE_RADPS, MAX_RATE_RADPS)
        yaw = _bounded(yaw_error * ATTITUDE_P / 4, -MAX_RATE_RADPS, MAX_RATE_RADPS)
        (p, q, r), (ix, iy, iz) = motion.spin_radps, self._model.inertia
        torque = (
            ix * RATE_P * (roll - p),
            iy * RATE_P * (pitch - q),
            iz * YAW_RATE_P * (yaw - r),
        )
        return mix(thrust_n, torque, self._model)


def _approach_mps(distance_m: float, acceleration_mps2: float) -> float:
    """Return the speed from which a UAV stops within a distance, if it brakes so hard.

    Far away v² = 2 a (d - d0 / 2), near by v = P d; both have the same value and slope at
    d0 = a / P².
    """
    braking = BRAKING_SHARE * acceleration_mps2
    near_m = braking / POSITION_P**2
    if distance_m <= near_m:
        return POSITION_P * distance_m
    return math.sqrt(2 * braking * (distance_m - near_m / 2))


def _bounded(value: float, low: float, high: float) -> float:
    # Half the time of min(high, max(low, value)), in the innermost loop.
    return low if value < low else high if value > high else value


def _z_axis(q: Quaternion) -> Vector:
    x, y, z, w = q
    return 2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)


def _yaw(q: Quaternion) -> float:
    x, y, z, w = q
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _unit(v: Vector) -> Vector:
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return v[0] / length, v[1] / length, v[2] / length


def _to_body(q: Quaternion, v: Vector) -> Vector:
    x, y, z, w = -q[0], -q[1], -q[2], q[3]
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )
