"""ArduPilot Copter's modes over its flight control: what a companion program commands.

GUIDED flies to positions, at velocities and to headings; LAND comes straight down, onto the target
of ``LANDING_TARGET`` if ``PLND_ENABLED`` is set; RTL climbs, returns and lands.  LOITER, POSHOLD,
ALT_HOLD, BRAKE and STABILIZE hold the place, since nobody moves the sticks.  Written from
ArduPilot's published documentation of modes, commands and parameters.

The face of this class is ArduPilot's: north, east, down in metres from the home position's map, and
forward, right, down.  Orders act when they are given; who delays them is the link.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from pytest_garl.airframe import Airframe
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import (
    Abort,
    Command,
    Diagnostics,
    Land,
    Mission,
    MotorThrusts,
    PositionSetpoint,
    VehicleState,
)
from pytest_garl.vehicle.controller import ArduPilotControl
from pytest_garl.vehicle.lift import vehicle_of
from pytest_garl.vehicle.named_parameters import Parameters, check_names
from pytest_garl.vehicle.ned import flipped, heading_of, turned
from pytest_garl.vehicle.rotations import Vector, rotate, yaw_of

FEET_M = 0.2
"""Height of the vehicle's position while it stands."""
IN_AIR_M = 0.5
"""A vehicle that is higher at its first moment begins in a hover."""
MODES: Mapping[str, int] = {
    "STABILIZE": 0,
    "ALT_HOLD": 2,
    "AUTO": 3,
    "GUIDED": 4,
    "LOITER": 5,
    "RTL": 6,
    "LAND": 9,
    "POSHOLD": 16,
    "BRAKE": 17,
}
"""The modes by their number in HEARTBEAT."""
HOLDING = ("STABILIZE", "ALT_HOLD", "LOITER", "POSHOLD", "BRAKE")
FACE_BEYOND_M = 2.0
"""The nose turns towards a goal at least this far away, as with ``WP_YAW_BEHAVIOR`` 1, 2."""
MARKER_WITHIN_M = 7.5
"""Largest distance of the marker from ``Mission.gps_position_m``."""
RATE_TIMEOUT_S = 3.0
"""A yaw rate that is not renewed ends, as a velocity does."""
NEAR_M, STILL_S = 1.0, 3.0
"""The pilot changes the mode when the vehicle was this near to the coordinate for this time."""
Pilot = Literal["", "LAND", "LOITER"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ArduCopter:
    """The vehicle of a companion program: ArduPilot Copter.

    ``parameters`` are ArduPilot's, by name and in its units (``{"PLND_ENABLED": 1, "LAND_SPEED":
    30}``).  ``pilot`` is the mode into which a human pilot switches: with "LAND" the pilot takes
    off, flies to the mission's coordinate at the search altitude, waits there and switches, for
    programs that only help ArduPilot to land; by default the program does all of it.  Raises
    LandingSystemError for another mode, a parameter that nothing here reads, and a bad value.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    pilot: Pilot = ""

    def __post_init__(self) -> None:
        if self.pilot not in get_args(Pilot):
            raise LandingSystemError(
                f"ArduCopter.pilot = {self.pilot!r}: expected 'LAND' or 'LOITER', or '' for none"
            )
        check_names(self.parameters)

    def autopilot(self, airframe: Airframe, mission: Mission) -> Autopilot:
        """Return the vehicle of one flight."""
        return Autopilot(airframe, mission, self)


class AirborneControl(ArduPilotControl):
    """ArduPilot's flight control, which can begin in the air."""

    def hover(self, state: VehicleState, ground_m: float) -> None:
        """Hold this place in GUIDED, with the motors at the throttle that carries the vehicle."""
        x, y, z = state.position_m
        vx, vy, vz = state.velocity_mps
        self._state, self._time_s = state, state.time_s
        while self._spool.update(True) != "unlimited":
            pass
        self._lifted, self._ground_m = True, ground_m
        self._horizontal.reset((x, y), (vx, vy))
        self._vertical.reset(z, vz, self.parameters.mot_thst_hover)
        self._motors.reset(state.attitude)
        self._detector.reset(landed=False)
        self.mode = "guided"
        self.guide(position=(x, y, z), yaw=yaw_of(state.attitude))

    def cut(self) -> None:
        """Stop the motors at once, wherever the vehicle is."""
        self.mode = "stopped"


class Autopilot:
    """One vehicle of a flight; call ``control`` once per control step, and orders in between.

    ``state`` is its estimate of its state, of the last control step.
    """

    first_mode, air_mode = "STABILIZE", "GUIDED"
    """The mode on the ground, and that of a flight that begins in the air."""
    guided_modes: tuple[str, ...] = ("GUIDED",)
    """The modes in which setpoints are flown."""
    kind = "MAV_AUTOPILOT_ARDUPILOTMEGA"
    pilot_modes: Mapping[str, str] = {"LAND": "LAND", "LOITER": "LOITER"}
    """What the human pilot switches to."""

    def __init__(self, airframe: Airframe, mission: Mission, vehicle: Any) -> None:
        throttle = vehicle_of(airframe).hover_throttle
        self.parameters = self._new_parameters(throttle, vehicle.parameters)
        self._airframe, self._mission, self._pilot = airframe, mission, vehicle.pilot
        self._control = AirborneControl(airframe, self.parameters.flown)
        self._ground_m = FEET_M
        x, y, _ = mission.home_m
        self.home_m: Vector = (x, y, FEET_M)
        self.origin_m: Vector = self.home_m
        self.mode = self.air_mode if vehicle.pilot else self.first_mode
        self.armed = False
        self.state: VehicleState | None = None
        self._armed_s = 0.0
        self._has_flown = False
        self.target_m: Vector | None = None
        """Where the last measurement of the landing target was, as of ``target_s``."""
        self.target_s = -math.inf
        self._goal: Vector | None = None
        self._turn: tuple[float, float] = (0.0, 0.0)
        self._return: Callable[[VehicleState], None] | None = None
        self.returns_since_s: float | None = None
        """When it got the command to return home; None in another mode."""
        self._is_home = False
        self._near_s: float | None = None
        self.told: list[str] = []
        """What STATUSTEXT shall say next."""

    def _new_parameters(self, hover_throttle: float, changes: Mapping[str, float]) -> Parameters:
        return Parameters(hover_throttle, changes)

    # The state, as it is told.

    @property
    def mode_number(self) -> int:
        """The mode as HEARTBEAT tells it."""
        return MODES[self.mode]

    def mode_of(self, number: float, sub: float = 0.0) -> str:
        """Return the mode of a number in a command; empty if there is none."""
        del sub
        return next((name for name, each in MODES.items() if each == int(number)), "")

    @property
    def now(self) -> VehicleState:
        """The state; raises RuntimeError before the first control step."""
        if self.state is None:
            raise RuntimeError("the vehicle has no state before its first control step")
        return self.state

    @property
    def local_ned_m(self) -> Vector:
        """Place from the origin."""
        return turned(_minus(self.now.position_m, self.origin_m))

    @property
    def height_m(self) -> float:
        """Height above the home position."""
        return self.now.position_m[2] - self.home_m[2]

    @property
    def landed(self) -> bool:
        """Whether it stands on the ground."""
        return not self._control.flying

    @property
    def phase(self) -> str:
        """What it does, in words."""
        if self._control.mode == "land" and self.parameters.flown.plnd_enabled:
            return f"{self.mode}, target {self.precision_status}"
        return self.mode

    @property
    def precision_status(self) -> str:
        """The state of precision landing in words."""
        return self._control.precision.status

    # Orders.

    def arm(self) -> bool:
        """Arm on the ground, or stay armed; return whether it is armed."""
        if not self.armed:
            self.armed, self._armed_s = True, self.now.time_s
            x, y, z = self.now.position_m
            self.home_m, self._ground_m = (x, y, z), z
            self.told.append("Arming motors")
        return True

    def disarm(self, *, force: bool = False) -> bool:
        """Stop the motors; in the air only by force.  Return whether it is disarmed."""
        if not self.landed and not force:
            return False
        if self.armed:
            self.told.append("Disarming motors")
        self._control.cut()
        self.armed = False
        return True

    def set_mode(self, mode: str) -> bool:
        """Enter a mode; return whether the vehicle has it."""
        if mode not in MODES or mode == "AUTO":
            return False
        if mode == self.mode:
            return True
        self.mode, self._return, self._turn = mode, None, (0.0, 0.0)
        self._is_home, self.returns_since_s = False, None
        if mode == "LAND":
            self._control.land()
        elif mode == "RTL":
            p = self.parameters
            self._begin_return(p["RTL_ALT"] / 100, p["RTL_LOIT_TIME"] / 1000)
        elif self._control.flying:
            # GUIDED holds the place until it gets another one.
            self._hold()
        return True

    def take_off(self, height_m: float) -> bool:
        """Climb to a height above home, armed and in GUIDED; return whether it does."""
        if not self.armed or self.mode != "GUIDED" or not self.landed or not height_m > 0:
            return False
        self._climb(height_m)
        return True

    def _climb(self, height_m: float) -> None:
        x, y, _ = self.now.position_m
        self._goal = x, y, self.home_m[2] + height_m
        self._has_flown = True
        self._control.take_off(height_m)

    def go_to(
        self,
        place_m: Vector | None,
        *,
        velocity_mps: Vector | None = None,
        acceleration_mps2: Vector | None = None,
        yaw_rad: float | None = None,
        yaw_rate_radps: float | None = None,
    ) -> bool:
        """Take a GUIDED setpoint in the world's frame (ENU); return whether the mode takes it.

        Without a yaw the nose turns towards a goal that is far, as ``WP_YAW_BEHAVIOR`` says.
        """
        if self.mode not in self.guided_modes or not self._control.flying:
            return False
        x, y, z = self.now.position_m
        if place_m is not None:
            self._goal = place_m
            east, north = place_m[0] - x, place_m[1] - y
            faces = self._faces_goals
            if yaw_rad is None and yaw_rate_radps is None and faces:
                far = math.hypot(east, north) > FACE_BEYOND_M
                yaw_rad = math.atan2(north, east) if far else None
        elif velocity_mps is not None:
            self._goal = x, y, z
        self._turn = (yaw_rate_radps or 0.0, self.now.time_s)
        self._control.guide(
            position=place_m, velocity=velocity_mps, acceleration=acceleration_mps2, yaw=yaw_rad
        )
        return True

    @property
    def _faces_goals(self) -> bool:
        return self.parameters["WP_YAW_BEHAVIOR"] in (1, 2)

    def face(self, yaw_rad: float) -> bool:
        """Turn the nose (ENU: counter-clockwise from east) in GUIDED."""
        if self.mode not in self.guided_modes or not self._control.flying:
            return False
        self._turn = (0.0, 0.0)
        self._control.guide(yaw=yaw_rad)
        return True

    def limit_speed(self, *, along: float | None = None, up: float | None = None) -> None:
        """Take the speed of DO_CHANGE_SPEED in m/s, as the parameters have it."""
        if along is not None:
            self.parameters.set("WPNAV_SPEED", 100 * along)
        if up is not None:
            self.parameters.set("WPNAV_SPEED_UP", 100 * up)

    def landing_target(
        self, direction_frd: Vector, *, distance_m: float, rangefinder_m: float | None, level: bool
    ) -> None:
        """Take a measurement of the landing target, which lies along ``direction_frd``.

        ``distance_m`` is 0 if it was not measured: then the height is that of the rangefinder, and
        without one the measurement is of no use.  With ``level`` the camera is held level.
        """
        size = math.hypot(*direction_frd)
        if not 0 < size < math.inf or not 0 <= distance_m < math.inf:
            return
        state = self.now
        yaw = yaw_of(state.attitude)
        turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)) if level else state.attitude
        east, north, up = rotate(turn, flipped(direction_frd))
        scale = distance_m / size
        if not distance_m:
            if rangefinder_m is None or up >= 0:
                return
            scale = rangefinder_m * rotate(state.attitude, (0.0, 0.0, 1.0))[2] / -up
        x, y, z = state.position_m
        self.target_m = (x + east * scale, y + north * scale, z + up * scale)
        self.target_s = state.time_s
        self._control.landing_target(self.target_m, state.time_s)

    def target_at(self, place_m: Vector) -> None:
        """Take a landing target in the local frame (ENU from the origin): ArduPilot takes none."""

    def in_world(self, vector: Vector, *, heading: bool = False) -> Vector:
        """Return a vector of north, east, down, or of the vehicle's heading, in the world's frame.

        Of the heading it is forward, right, down of a level vehicle.
        """
        if not heading:
            return turned(vector)
        forward, left, up = flipped(vector)
        yaw = yaw_of(self.now.attitude)
        c, s = math.cos(yaw), math.sin(yaw)
        return c * forward - s * left, s * forward + c * left, up

    def in_world_yaw(self, yaw_rad: float, *, relative: bool = False) -> float:
        """Return a heading, clockwise from north or from the nose, as an angle of the world."""
        return yaw_of(self.now.attitude) - yaw_rad if relative else heading_of(yaw_rad)

    # What flies.

    def control(self, state: VehicleState) -> MotorThrusts:
        """Return the motors' thrusts for one control step."""
        if self.state is None and state.position_m[2] > FEET_M + IN_AIR_M:
            self.state = state
            self.mode, self.armed, self._has_flown = self.air_mode, True, True
            self._control.hover(state, FEET_M)
            self._goal = state.position_m
        self.state = state
        if self._pilot:
            self._fly_as_pilot(state)
        if self._return is not None:
            self._return(state)
        rate, since_s = self._turn
        if rate and state.time_s - since_s <= RATE_TIMEOUT_S and self._control.flying:
            yaw = self._control.heading_rad - rate / (self._airframe.control_rate_hz or 1.0)
            self._control.guide(yaw=yaw)
        thrusts = self._control.control(state)
        if self.armed and self._control.mode == "stopped":
            self._stand_armed(state)
        return thrusts

    def command(self, told: Diagnostics) -> Command:
        """Return what the vehicle does, for the record: the motors are flown by ``control``.

        A flight ends when the vehicle is back over a home where the marker cannot lie; it was
        given up at ``returns_since_s``.
        """
        if self._is_home:
            return Abort(diagnostics=told)
        comes_down = self._control.mode == "land" or (self._goal is not None and self.landed)
        if comes_down and self._control.mode != "take-off":
            return Land(diagnostics=told)
        goal = self._goal or self._mission.home_m
        return PositionSetpoint(position_m=goal, yaw_rad=None, diagnostics=told)

    def _stand_armed(self, state: VehicleState) -> None:
        """Disarm after a landing, and some seconds after arming if nothing took off."""
        landed = self.mode in ("LAND", "RTL")
        if landed or state.time_s - self._armed_s > self.parameters["DISARM_DELAY"]:
            self.disarm()

    def _hold(self) -> None:
        self._goal = self.now.position_m
        self._control.guide(position=self._goal)

    def _begin_return(self, height_m: float, stay_s: float) -> None:
        if not self._control.flying:
            self._control.land()
            return
        x, y, z = self.now.position_m
        self.returns_since_s = self.now.time_s
        top = max(z, self.home_m[2] + height_m)
        legs = [(x, y, top), (self.home_m[0], self.home_m[1], top)]
        arrived: list[float] = []

        def go_on(state: VehicleState) -> None:
            if legs:
                self._goal = legs[0]
                self._control.guide(position=self._goal)
                if math.dist(state.position_m, legs[0]) < NEAR_M:
                    legs.pop(0)
                    arrived.append(state.time_s)
                    away_m = math.dist(self.home_m[:2], self._mission.gps_position_m)
                    self._is_home = not legs and away_m > MARKER_WITHIN_M
            elif state.time_s - arrived[-1] > stay_s:
                self._return = None
                self._control.land()

        self._return = go_on

    def _fly_as_pilot(self, state: VehicleState) -> None:
        """Take off, fly to the coordinate and switch to the pilot's mode, once."""
        height = self._mission.search_altitude_m
        if self.landed:
            if not self.armed:
                self.arm()
                self.take_off(height)
            return
        goal = (*self._mission.gps_position_m, self.home_m[2] + height)
        if self._control.mode == "take-off" and state.position_m[2] < goal[2] - NEAR_M:
            return
        if self._goal != goal:
            self._goal = goal
            self._control.guide(position=goal)
        if math.dist(state.position_m, goal) > NEAR_M:
            self._near_s = None
        elif self._near_s is None:
            self._near_s = state.time_s
        elif state.time_s - self._near_s > STILL_S:
            mode, self._pilot = self.pilot_modes[self._pilot], ""
            self.set_mode(mode)


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
