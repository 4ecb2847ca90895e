"""PX4's modes over the same flight control: OFFBOARD with its loss failsafe, and its landings.

What a companion sees of PX4 is here: its modes and their numbers, that OFFBOARD needs a stream of
setpoints, precision landing with its search, its parameters' names.  ArduPilot's control stays
beneath: how the vehicle accelerates and settles is ArduPilot's.  Written from PX4's published
documentation of modes and parameters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from pytest_garl.airframe import Airframe
from pytest_garl.errors import LandingSystemError
from pytest_garl.landing_system import Mission, VehicleState
from pytest_garl.vehicle.autopilot import FEET_M, NEAR_M, Autopilot, Pilot
from pytest_garl.vehicle.named_parameters import Parameters
from pytest_garl.vehicle.rotations import Vector

MODES: Mapping[str, tuple[int, int]] = {
    "MANUAL": (1, 0),
    "ALTCTL": (2, 0),
    "POSCTL": (3, 0),
    "AUTO.TAKEOFF": (4, 2),
    "AUTO.LOITER": (4, 3),
    "AUTO.RTL": (4, 5),
    "AUTO.LAND": (4, 6),
    "AUTO.PRECLAND": (4, 9),
    "OFFBOARD": (6, 0),
}
"""Main and sub mode by name."""
DEFAULTS: Mapping[str, float] = {
    "COM_DISARM_LAND": 2.0,
    "COM_DISARM_PRFLT": 10.0,
    "COM_OBL_RC_ACT": 0.0,
    "COM_OF_LOSS_T": 1.0,
    "MIS_TAKEOFF_ALT": 2.5,
    "MPC_LAND_SPEED": 0.7,
    "MPC_XY_CRUISE": 5.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "PLD_BTOUT": 5.0,
    "PLD_FAPPR_ALT": 0.1,
    "PLD_HACC_RAD": 0.2,
    "PLD_MAX_SRCH": 3.0,
    "PLD_SRCH_ALT": 10.0,
    "PLD_SRCH_TOUT": 10.0,
    "RTL_LAND_DELAY": 0.0,
    "RTL_RETURN_ALT": 60.0,
    "SYS_AUTOSTART": 4001.0,
}
"""Parameters that are read here, with PX4's defaults and in its units."""
_OF_CONTROL = {
    "MPC_LAND_SPEED": "LAND_SPEED",
    "MPC_XY_CRUISE": "WPNAV_SPEED",
    "MPC_Z_VEL_MAX_DN": "WPNAV_SPEED_DN",
    "MPC_Z_VEL_MAX_UP": "WPNAV_SPEED_UP",
}
LOSS_MODES = {
    0: "POSCTL",
    1: "ALTCTL",
    2: "MANUAL",
    3: "AUTO.RTL",
    4: "AUTO.LAND",
    5: "AUTO.LOITER",
}
"""What follows the loss of OFFBOARD's setpoints, by COM_OBL_RC_ACT."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Px4Copter:
    """The vehicle of a companion program: PX4's modes over ArduPilot's flight control.

    ``parameters`` are PX4's (``{"COM_OBL_RC_ACT": 4}``).  ``pilot`` is the mode into which a human
    pilot switches after a take-off and a flight to the mission's coordinate: "LAND" stands for
    AUTO.PRECLAND.  Raises LandingSystemError for a parameter that is not simulated, for a value
    that is not finite, and for another mode.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    pilot: Pilot = ""

    def __post_init__(self) -> None:
        if self.pilot not in get_args(Pilot):
            raise LandingSystemError(
                f"Px4Copter.pilot = {self.pilot!r}: expected 'LAND' or 'LOITER', or '' for none"
            )
        for name, value in self.parameters.items():
            if name not in DEFAULTS or not math.isfinite(value):
                raise LandingSystemError(
                    f"Px4Copter.parameters: found {name} = {value}; expected a finite number for "
                    f"one of {', '.join(DEFAULTS)}"
                )

    def autopilot(self, airframe: Airframe, mission: Mission) -> Px4Autopilot:
        """Return the vehicle of one flight."""
        return Px4Autopilot(airframe, mission, self)


class Px4Parameters(Parameters):
    """PX4's names; those that the control has too act there."""

    def __init__(self, hover_throttle: float, changes: Mapping[str, float]) -> None:
        super().__init__(hover_throttle, {})
        self._named = {**DEFAULTS, **changes}
        for name, value in self._named.items():
            self._act(name, value)

    def __getitem__(self, name: str) -> float:
        return self._named[name]

    def items(self) -> Iterator[tuple[str, float]]:
        """Yield names and values, in the order of the names."""
        yield from sorted(self._named.items())

    def set(self, name: str, value: float) -> None:
        """Take a value in PX4's unit."""
        self._named[name] = float(value)
        self._act(name, value)

    def _act(self, name: str, value: float) -> None:
        if name in _OF_CONTROL:
            super().set(_OF_CONTROL[name], 100 * value)


class Px4Autopilot(Autopilot):
    """One vehicle of a flight, as PX4 behaves."""

    first_mode, air_mode = "POSCTL", "AUTO.LOITER"
    guided_modes = ("OFFBOARD",)
    kind = "MAV_AUTOPILOT_PX4"
    pilot_modes: Mapping[str, str] = {"LAND": "AUTO.PRECLAND", "LOITER": "AUTO.LOITER"}

    def __init__(self, airframe: Airframe, mission: Mission, vehicle: Px4Copter) -> None:
        super().__init__(airframe, mission, vehicle)
        self._setpoint_s = -math.inf
        self._streams_since_s = -math.inf

    def _new_parameters(self, hover_throttle: float, changes: Mapping[str, float]) -> Parameters:
        return Px4Parameters(hover_throttle, changes)

    @property
    def mode_number(self) -> int:
        """The mode as HEARTBEAT tells it."""
        main, sub = MODES[self.mode]
        return main << 16 | sub << 24

    def mode_of(self, number: float, sub: float = 0.0) -> str:
        """Return the mode of a command's numbers, or of SET_MODE's; empty if there is none."""
        whole = int(number)
        pair = (whole, int(sub)) if whole < 1 << 16 else (whole >> 16 & 0xFF, whole >> 24)
        return next((name for name, each in MODES.items() if each == pair), "")

    def set_mode(self, mode: str) -> bool:
        """Enter a mode; OFFBOARD needs setpoints that arrive already."""
        mode = {"LAND": "AUTO.LAND", "RTL": "AUTO.RTL", "LOITER": "AUTO.LOITER"}.get(mode, mode)
        if mode not in MODES or (mode == "OFFBOARD" and not self._streams):
            return False
        if mode == self.mode:
            return True
        self.mode, self._return, self._turn = mode, None, (0.0, 0.0)
        self._is_home, self.returns_since_s = False, None
        if mode == "AUTO.LAND":
            self._control.land()
        elif mode == "AUTO.PRECLAND":
            self._return = self._precision_landing()
        elif mode == "AUTO.RTL":
            self._begin_return(self.parameters["RTL_RETURN_ALT"], self.parameters["RTL_LAND_DELAY"])
        elif self._control.flying:
            self._hold()
        return True

    @property
    def _streams(self) -> bool:
        """Whether setpoints arrive."""
        return self.now.time_s - self._setpoint_s <= self.parameters["COM_OF_LOSS_T"]

    def take_off(self, height_m: float) -> bool:
        """Enter AUTO.TAKEOFF; the height is above the sea in PX4, as the link has made it here."""
        if not self.armed or not self.landed:
            return False
        self.mode = "AUTO.TAKEOFF"
        height = height_m if math.isfinite(height_m) else self.parameters["MIS_TAKEOFF_ALT"]
        self._climb(max(height, 0.5))
        return True

    def go_to(self, place_m: Vector | None, **how: Any) -> bool:
        """Take a setpoint: it counts for the stream in every mode, and is flown in OFFBOARD."""
        self._setpoint_s = self.now.time_s
        if self.mode != "OFFBOARD":
            return False
        if self.armed and self.landed:
            # Armed in OFFBOARD, a setpoint above the ground takes off.
            climb = (how.get("velocity_mps") or (0.0, 0.0, 0.0))[2]
            height = place_m[2] - self.home_m[2] if place_m is not None else 2.0 * (climb > 0.1)
            if height > 0.3 and self._control.mode == "stopped":
                self._climb(height)
            return True
        if self._control.mode == "take-off" and not self._control.flying:
            return True
        how.setdefault("yaw_rad", None)
        return super().go_to(place_m, **how)

    def target_at(self, place_m: Vector) -> None:
        """Take the landing target of LANDING_TARGET, in the local frame."""
        ox, oy, oz = self.origin_m
        self.target_m = (ox + place_m[0], oy + place_m[1], oz + place_m[2])
        self.target_s = self.now.time_s

    @property
    def _faces_goals(self) -> bool:
        return False

    def landing_target(self, direction_frd: Vector, **how: Any) -> None:
        """Take no target relative to the body: PX4 takes LOCAL_NED only."""

    def control(self, state: VehicleState) -> Any:
        """Return the motors' thrusts; if setpoints stop in OFFBOARD, another mode follows."""
        if self.state is not None and self.mode == "OFFBOARD" and not self._streams:
            self.told.append("Failsafe: offboard control lost")
            self.set_mode(LOSS_MODES.get(int(self.parameters["COM_OBL_RC_ACT"]), "POSCTL"))
        climbs = self.mode == "AUTO.TAKEOFF" and self._control.flying
        if climbs and self._goal and abs(state.position_m[2] - self._goal[2]) < NEAR_M / 3:
            self.mode = "AUTO.LOITER"
            self._control.guide(position=self._goal)
        return super().control(state)

    def _stand_armed(self, state: VehicleState) -> None:
        waits = self.parameters["COM_DISARM_PRFLT"]
        if self._has_flown or (waits > 0 and state.time_s - self._armed_s > waits):
            self.disarm()

    def _precision_landing(self) -> Callable[[VehicleState], None]:
        """Return the steps: over the target, down above it, and a search where there is none."""
        p = self.parameters
        searches, since_s = 0, self.now.time_s

        def go_on(state: VehicleState) -> None:
            nonlocal searches, since_s
            x, y, z = state.position_m
            if self.target_m is not None and state.time_s - self.target_s <= p["PLD_BTOUT"]:
                tx, ty, tz = self.target_m
                beside = math.dist((x, y), (tx, ty))
                if z - max(tz, FEET_M) < max(p["PLD_FAPPR_ALT"], 0.1) + FEET_M:
                    self._return = None
                    self._control.land()
                elif beside < p["PLD_HACC_RAD"]:
                    down = (0.0, 0.0, -p["MPC_LAND_SPEED"])
                    self._control.guide(position=(tx, ty, z + down[2] / 2), velocity=down)
                    self._goal = (tx, ty, tz)
                else:
                    self._goal = (tx, ty, self._goal[2] if self._goal else z)
                    self._control.guide(position=self._goal)
                since_s = state.time_s
                return
            top = self.home_m[2] + p["PLD_SRCH_ALT"]
            if searches >= p["PLD_MAX_SRCH"]:
                self._return = None
                self._control.land()
            elif state.time_s - since_s > p["PLD_SRCH_TOUT"]:
                searches, since_s = searches + 1, state.time_s
            else:
                self._goal = (*(self._goal or (x, y, z))[:2], max(z, top))
                self._control.guide(position=self._goal)

        self._goal = self.now.position_m
        return go_on
