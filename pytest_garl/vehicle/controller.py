"""The controller: modes, and one control step from the vehicle's state to motor thrusts."""

from __future__ import annotations

import math
from typing import Literal

from pytest_garl.landing_system import Airframe, MotorThrusts, VehicleState
from pytest_garl.vehicle.altitude import VerticalControl
from pytest_garl.vehicle.guidance import ZERO, Setpoint, follow
from pytest_garl.vehicle.land_mode import LandMode
from pytest_garl.vehicle.lift import vehicle_of
from pytest_garl.vehicle.motor_output import MotorOutput
from pytest_garl.vehicle.parameters import ArduPilotParameters, tuned
from pytest_garl.vehicle.position import HorizontalControl
from pytest_garl.vehicle.precision_landing import PrecisionLanding
from pytest_garl.vehicle.rotations import Vector, yaw_of
from pytest_garl.vehicle.shaping import Pair
from pytest_garl.vehicle.spool import Spool
from pytest_garl.vehicle.touchdown_detector import LandDetector

Mode = Literal["stopped", "take-off", "guided", "land"]

STANDSTILL = MotorThrusts(newtons=(0.0, 0.0, 0.0, 0.0))
LIFTED_M = 0.05
LIFTED_MPS = 0.10
"""The vehicle has left the ground: engineering choice, above what springs and noise do."""
MOVING_MPS2 = 3.0
"""ArduPilot does not let the motors idle for a landing while it feels more than this."""


class ArduPilotControl:
    """Flies a quadrotor as ArduPilot Copter does; see the package's docstring.

    Call ``control`` once per 1 / ``airframe.control_rate_hz`` from the first moment on, and
    the orders ``take_off``, ``guide``, ``land``, ``landing_target`` at any time between.  Raises
    ValueError for an airframe without this rate.
    """

    def __init__(self, airframe: Airframe, parameters: ArduPilotParameters | None = None) -> None:
        vehicle = vehicle_of(airframe)
        self.parameters = parameters or tuned(vehicle.hover_throttle)
        self._full_n = vehicle.max_thrust_n
        self._dt = _control_step_s(airframe)
        self.reset()

    def reset(self) -> None:
        """Stand on the ground with the motors off."""
        p, dt = self.parameters, self._dt
        self.mode: Mode = "stopped"
        self._landing = LandMode(p)
        self._horizontal, self._vertical = HorizontalControl(p, dt), VerticalControl(p, dt)
        self._motors = MotorOutput(p, dt, self._full_n)
        self._detector, self._spool = LandDetector(dt), Spool(p.mot_spool_time, dt)
        self._ramp, self._lifted = 0.0, False
        self._velocity: Vector | None = None
        self._time_s = self._ground_m = self._take_off_m = self._yaw = 0.0
        self._hold: Pair = (0.0, 0.0)
        self._setpoint: Setpoint | None = None
        self._state: VehicleState | None = None

    @property
    def landed(self) -> bool:
        """Whether the land detector believes that the vehicle stands on the ground."""
        return self._detector.landed

    @property
    def flying(self) -> bool:
        """Whether the vehicle has left the ground and was not found to have landed."""
        return self.mode != "stopped" and self._lifted

    @property
    def precision(self) -> PrecisionLanding:
        """The landing target as LAND uses it."""
        return self._landing.precision

    @property
    def target_position_m(self) -> Vector:
        """The shaped target (x, y, z) that the position loop follows."""
        x, y = self._horizontal.target.position
        return x, y, self._vertical.target.position

    @property
    def heading_rad(self) -> float:
        """The heading that the vehicle shall have."""
        return self._yaw

    def take_off(self, height_m: float) -> None:
        """Start the motors and climb straight up to a height above the ground; then hold.

        Ignored in the air.
        """
        if self.mode == "stopped":
            self.mode = "take-off"
            self._take_off_m = height_m
            self._ramp, self._lifted = 0.0, False

    def guide(
        self,
        *,
        position: Vector | None = None,
        velocity: Vector | None = None,
        acceleration: Vector | None = None,
        yaw: float | None = None,
        speed: float | None = None,
    ) -> None:
        """Take a GUIDED setpoint in the world frame (m, m/s, m/s², rad, m/s).

        A position alone is flown to and held; a position with a velocity moves on with it; a
        velocity alone is flown until ``GUID_TIMEOUT``.  ``speed`` bounds the speed on the way
        (``WPNAV_SPEED`` and so on bound it anyway).  Values that are not given stay: the heading,
        and the place if there is neither position nor velocity.  Ignored while the motors are off.
        """
        if self.mode == "stopped":
            return
        if yaw is not None:
            self._yaw = yaw
        if position is None and velocity is None:
            return
        self._setpoint = Setpoint(
            time_s=self._time_s,
            position_m=position,
            velocity_mps=velocity or ZERO,
            acceleration_mps2=acceleration or ZERO,
            speed_mps=speed if speed is not None else math.inf,
        )
        self.mode = "guided"

    def land(self) -> None:
        """Enter LAND: stop, come down, and stop the motors; no order while it is landing.

        On the ground it stops the motors.  With ``PLND_ENABLED`` it lands on the target that
        ``landing_target`` tells of.
        """
        if not self._lifted:
            self.mode = "stopped"
        if self.mode in ("stopped", "land"):
            return
        self.mode = "land"
        self._landing.begin(self._horizontal.target.stopping_point())

    def landing_target(self, position_m: Vector, time_s: float) -> None:
        """Take a detector's measurement of the target's place in the world, as of ``time_s``.

        It may be called before and during LAND; LAND uses the estimate from 2 s after the
        first call on.
        """
        if self._state is not None:
            self._landing.measure(position_m, time_s, self._state)

    def control(self, state: VehicleState) -> MotorThrusts:
        """Return the motor thrusts for the next control step."""
        self._state, self._time_s = state, state.time_s
        acceleration = _slope(self._velocity or state.velocity_mps, state.velocity_mps, self._dt)
        self._velocity = state.velocity_mps
        spool = self._spool.update(self.mode != "stopped")
        if self.mode == "stopped" or spool == "ground idle":
            # ArduPilot disarms when it has landed: the motors stop at once, not by a ramp.
            self._stand(state)
            return STANDSTILL
        self._aim(state)
        return self._fly(state, acceleration)

    def _stand(self, state: VehicleState) -> None:
        """Keep every loop ready while the vehicle stands; where it stands is the ground."""
        x, y, z = state.position_m
        self._ground_m = z
        self._horizontal.reset((x, y), (0.0, 0.0))
        self._vertical.reset(z, 0.0, 0.0)
        self._motors.reset(state.attitude)
        self._detector.reset(landed=True)
        self._hold = x, y
        self._yaw = yaw_of(state.attitude)

    def _aim(self, state: VehicleState) -> None:
        """Move the targets by what the mode wants."""
        p = self.parameters
        horizontal, vertical = self._horizontal, self._vertical
        if not self._lifted:
            self._hold = state.position_m[0], state.position_m[1]
        elif self.mode == "land":
            height = state.position_m[2] - self._ground_m
            maybe = self._detector.maybe_landed
            self._landing.aim(state, height, horizontal, vertical, maybe_landed=maybe)
        elif self.mode == "guided" and self._setpoint is not None:
            follow(self._setpoint, state.time_s, horizontal, vertical, p)
        else:
            horizontal.target.towards(self._hold, top=p.wpnav_speed)
            height = self._ground_m + self._take_off_m
            vertical.target.towards(height, 0.0, -p.wpnav_speed_dn, p.wpnav_speed_up)

    def _fly(self, state: VehicleState, acceleration: Vector) -> MotorThrusts:
        motors = self._motors
        x, y, z = state.position_m
        vx, vy, vz = state.velocity_mps
        wanted: Pair = (0.0, 0.0)
        if self._lifted:
            wanted = self._horizontal.acceleration((x, y), (vx, vy))
            limited = motors.limits.lower or motors.limits.upper
            throttle = self._vertical.throttle(z, vz, acceleration[2], limited)
        else:
            throttle = self._lift(state)
        calm = (
            self._lifted
            and self._vertical.velocity_target < 0
            and self._detector.acceleration_mps2 < MOVING_MPS2
        )
        thrusts = motors.thrusts(
            state, wanted, throttle, yaw=self._yaw, top=self._spool.top, calm=calm
        )
        if self._lifted:
            self._detect(state, acceleration)
        return thrusts

    def _lift(self, state: VehicleState) -> float:
        """Raise the throttle until the vehicle leaves the ground, then hand it over."""
        self._ramp += self._dt / self.parameters.tkoff_slew_time
        throttle = self._ramp
        _, _, z = state.position_m
        climb = state.velocity_mps[2]
        if z > self._ground_m + LIFTED_M or climb > LIFTED_MPS:
            self._lifted = True
            self._vertical.reset(z, climb, throttle)
            self._detector.reset(landed=False)
        return throttle

    def _detect(self, state: VehicleState, acceleration: Vector) -> None:
        self._detector.update(
            throttle_low=self._motors.throttle_low,
            tilt_request_rad=self._motors.tilt_request_rad,
            tilt_error_rad=self._motors.tilt_error_rad,
            acceleration=acceleration,
            climb_mps=state.velocity_mps[2],
            height_m=state.position_m[2] - self._ground_m,
        )
        if self._detector.landed and self.mode == "land":
            self.mode = "stopped"


def _control_step_s(airframe: Airframe) -> float:
    if not airframe.control_rate_hz:
        raise ValueError(
            "ArduPilotControl flies the motors: expected an airframe with a control_rate_hz, "
            f"found {airframe.control_rate_hz}; declare Airframe(control_rate_hz=240)"
        )
    return 1 / airframe.control_rate_hz


def _slope(before: Vector, now: Vector, dt_s: float) -> Vector:
    rate = 1 / dt_s
    return (
        (now[0] - before[0]) * rate,
        (now[1] - before[1]) * rate,
        (now[2] - before[2]) * rate,
    )
