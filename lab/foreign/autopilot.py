"""The part of ArduPilot Copter that the foreign systems talk to.

It flies the motors with this project's reproduction of ArduPilot's flight control
(``pytest_garl/vehicle``): GUIDED flies to a position and holds it, LAND stops
and comes straight down, with precision landing on the target that LANDING_TARGET messages tell.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from lab.foreign.repository import ForeignCodeError
from landing_systems.modules.detection_opencv import rotation_matrix
from pytest_garl import (
    Airframe,
    Command,
    Detection,
    Diagnostics,
    Land,
    Mission,
    MotorThrusts,
    Observation,
    PositionSetpoint,
    VehicleState,
)
from pytest_garl.vehicle import ArduPilotParameters, tuned, vehicle_of
from pytest_garl.vehicle.autopilot import FEET_M, AirborneControl
from pytest_garl.vehicle.ned import heading_of, on_globe, on_map

CONTROL_RATE_HZ = 240.0
LEVEL_FRAME = "MAV_FRAME_LOCAL_FRD"
"""ArduPilot takes angles in this frame as those of a camera that is held level, and turns those in
other frames by the vehicle's attitude."""

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class GlobalPosition:
    """A place as MAVLink tells it: degrees, and metres above the ground."""

    lat: float
    lon: float
    alt: float


class Autopilot:
    """A vehicle that hovers at first; orders act after the airframe's latency."""

    def __init__(
        self, airframe: Airframe, mission: Mission, *, precision_landing: bool = False
    ) -> None:
        base = dataclasses.replace(ArduPilotParameters(), plnd_enabled=precision_landing)
        self._control = AirborneControl(airframe, tuned(vehicle_of(airframe).hover_throttle, base))
        self._latency_s = airframe.latency_s
        self._orders: deque[tuple[float, Callable[[], None]]] = deque()
        self._origin = mission.gps_position_m
        self._goal: Place | None = None
        self._flies = False
        self.mode = "GUIDED"
        self.observation: Observation
        self.target_m: Place | None = None
        """Where the target of this frame's message is."""

    def observe(self, observation: Observation) -> None:
        """Take the vehicle's estimate of its state at a camera frame."""
        self.observation = observation
        self.target_m = None
        if self._goal is None:
            self._goal = self.position_m

    def control(self, state: VehicleState) -> MotorThrusts:
        """Fly the motors for one control step."""
        if not self._flies:
            self._flies = True
            self._control.hover(state, FEET_M)
        while self._orders and self._orders[0][0] <= state.time_s:
            self._orders.popleft()[1]()
        return self._control.control(state)

    @property
    def position_m(self) -> Place:
        """Where the vehicle believes to be: east, north, up."""
        x, y, z = (float(each) for each in self.observation.position_m)
        return x, y, z

    @property
    def yaw_rad(self) -> float:
        """The nose's direction, counter-clockwise from east."""
        turn = rotation_matrix(self.observation.attitude)
        return math.atan2(turn[1, 0], turn[0, 0])

    @property
    def heading_rad(self) -> float:
        """The nose's direction, clockwise from north, from -pi to pi."""
        return heading_of(self.yaw_rad)

    @property
    def global_position(self) -> GlobalPosition:
        """Where the vehicle believes to be, in degrees."""
        x, y, z = self.position_m
        lat, lon = on_globe(x - self._origin[0], y - self._origin[1])
        return GlobalPosition(lat=lat, lon=lon, alt=z)

    @property
    def precision_status(self) -> str:
        """The state of precision landing in words."""
        return self._control.precision.status

    def place_of(self, goal: GlobalPosition) -> Place:
        """Return a global position as east, north, up."""
        east, north = on_map(goal.lat, goal.lon)
        return self._origin[0] + east, self._origin[1] + north, goal.alt

    def beside(self, forward_m: float, right_m: float) -> tuple[float, float]:
        """Return the place (x, y) that lies so far ahead and to the right of the vehicle."""
        x, y, _ = self.position_m
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return x + c * forward_m + s * right_m, y + s * forward_m - c * right_m

    def go_to(self, place_m: Place) -> None:
        """Take a position in GUIDED; another mode ignores it."""
        if self.mode == "GUIDED":
            self._goal = place_m
            self._later(functools.partial(self._control.guide, position=place_m))

    def land(self) -> None:
        """Enter LAND."""
        if self.mode != "LAND":
            self.mode = "LAND"
            self._later(self._control.land)

    def landing_target(self, message: Mapping[str, Any]) -> None:
        """Take a LANDING_TARGET with angles; without a range to the ground it is of no use."""
        frame = message["frame"]["type"]
        if frame != LEVEL_FRAME:
            raise ForeignCodeError(f"LANDING_TARGET: found frame {frame}, expected {LEVEL_FRAME}")
        measured = self.observation.rangefinder_m
        if measured is None:
            return
        height = measured * float(rotation_matrix(self.observation.attitude)[2, 2])
        forward, right = -math.tan(message["angle_y"]), math.tan(message["angle_x"])
        x, y = self.beside(forward * height, right * height)
        self.target_m = (x, y, self.position_m[2] - height)
        time_s = self.observation.time_s
        self._later(functools.partial(self._control.landing_target, self.target_m, time_s))

    def command(self, seen: tuple[Detection, ...], note: str = "") -> Command:
        """Return the order of the moment, for the record: the motors are flown by ``control``."""
        told = Diagnostics(
            phase=self.mode,
            detections=seen,
            target_m=seen[0].position_m if seen else None,
            note=note,
        )
        if self.mode == "LAND":
            return Land(diagnostics=told)
        return PositionSetpoint(
            position_m=self._goal or self.position_m, yaw_rad=None, diagnostics=told
        )

    def _later(self, order: Callable[[], None]) -> None:
        self._orders.append((self.observation.time_s + self._latency_s, order))
