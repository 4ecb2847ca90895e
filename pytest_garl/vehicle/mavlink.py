"""MAVLink bytes between a companion program and the autopilot, by pymavlink's dialect.

Messages that arrive are parsed, requests are answered, and the state is sent at the rates
of a stream.  The link knows no socket: bytes come in by ``receive`` and go out by ``send``.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Mapping
from typing import Any

from pytest_garl.errors import LandingSystemError
from pytest_garl.vehicle.autopilot import FEET_M, HOLDING, Autopilot
from pytest_garl.vehicle.ned import GROUND_AMSL_M, euler_of, flipped, on_globe, on_map, turned
from pytest_garl.vehicle.rotations import Vector

DIALECT = "pymavlink.dialects.v20.ardupilotmega"
SYSTEM, COMPONENT = 1, 1
BOOT_S = 30.0
"""Time since the vehicle was switched on, at the begin of a flight."""
STREAMS = {
    "HEARTBEAT": 1.0,
    "SYS_STATUS": 2.0,
    "SYSTEM_TIME": 1.0,
    "GPS_RAW_INT": 5.0,
    "EKF_STATUS_REPORT": 1.0,
    "EXTENDED_SYS_STATE": 2.0,
    "HOME_POSITION": 0.5,
    "ATTITUDE": 10.0,
    "LOCAL_POSITION_NED": 10.0,
    "GLOBAL_POSITION_INT": 10.0,
    "VFR_HUD": 10.0,
    "RANGEFINDER": 10.0,
    "DISTANCE_SENSOR": 10.0,
}
"""Messages of the state, and how often they are sent if nobody asks for more, in Hz."""
MOST_HZ = 50.0
_LEVEL_FRAME = "MAV_FRAME_LOCAL_FRD"
_ACCEPTED = ("MAV_RESULT_ACCEPTED", "MAV_RESULT_FAILED")
_FORCE = 21196.0
"""What param2 of MAV_CMD_COMPONENT_ARM_DISARM must be to disarm in flight."""
_NUMBERS = {
    22: (6,),  # MAV_CMD_NAV_TAKEOFF
    115: (0,),  # MAV_CMD_CONDITION_YAW
    176: (1,),  # MAV_CMD_DO_SET_MODE
    178: (1,),  # MAV_CMD_DO_CHANGE_SPEED
    192: (4, 5, 6),  # MAV_CMD_DO_REPOSITION
    400: (0,),  # MAV_CMD_COMPONENT_ARM_DISARM
    511: (0, 1),  # MAV_CMD_SET_MESSAGE_INTERVAL
    512: (0,),  # MAV_CMD_REQUEST_MESSAGE
}
"""The parameters of a command that must be finite numbers; the others may be NaN, which leaves a
choice to the vehicle."""
_EKF_GOOD = 831
"""Flags of an estimator that knows attitude, velocities, and absolute and relative positions."""


def dialect() -> Any:
    """Return pymavlink's dialect; raise LandingSystemError if it is not installed."""
    try:
        return importlib.import_module(DIALECT)
    except ImportError as error:
        raise LandingSystemError(
            "a companion program speaks MAVLink with the vehicle, and pymavlink is not installed "
            "beside pytest-garl: python -m pip install 'pytest-garl[mavlink]'"
        ) from error


class MavlinkLink:
    """The vehicle's end of a link; ``send`` takes the bytes that go to the program.

    ``heard`` is whether a message of the program has arrived.
    """

    def __init__(self, autopilot: Autopilot, send: Callable[[bytes], None]) -> None:
        self._d = dialect()
        self._autopilot, self._send = autopilot, send
        self._mav = self._d.MAVLink(self, srcSystem=SYSTEM, srcComponent=COMPONENT)
        self._mav.robust_parsing = True
        self._every_s = {name: 1 / hz for name, hz in STREAMS.items()}
        self._due_s = dict.fromkeys(STREAMS, 0.0)
        self.rangefinder_m: float | None = None
        self.heard = False
        self.nonsense = ""
        """A message with a field that is no finite number, though it must be one."""

    def write(self, data: bytes) -> None:
        """Send what pymavlink packs."""
        self._send(bytes(data))

    def receive(self, data: bytes) -> None:
        """Take bytes of the program; what is no MAVLink is left out."""
        for message in self._mav.parse_buffer(data) or ():
            kind = message.get_type()
            # None of this vehicle's: garbage, or a message to another system.
            if kind == "BAD_DATA" or getattr(message, "target_system", 0) not in (0, SYSTEM):
                continue
            self.heard = True
            handler = getattr(self, f"_on_{kind.lower()}", None)
            if handler is not None:
                handler(message)

    def tell(self) -> None:
        """Send what is due of the state; called at 50 Hz."""
        now = self._autopilot.now.time_s
        for name, due in self._due_s.items():
            every = self._every_s[name]
            if every > 0 and now >= due - 1e-9:
                self._due_s[name] = max(due, now - every) + every
                self._tell(name)
        for text in self._autopilot.told:
            self._mav.statustext_send(self._d.MAV_SEVERITY_INFO, text.encode()[:50])
        self._autopilot.told.clear()

    # Messages to the program.

    def _tell(self, name: str) -> None:
        getattr(self, f"_tell_{name.lower()}")()

    @property
    def _ms(self) -> int:
        return round(1000 * (BOOT_S + self._autopilot.now.time_s))

    @property
    def _velocity_ned(self) -> Vector:
        return turned(self._autopilot.now.velocity_mps)

    @property
    def _place(self) -> tuple[int, int, int, int]:
        """Latitude and longitude (1e-7 degrees), heights above the sea and home (mm)."""
        x, y, z = self._autopilot.now.position_m
        lat, lon = on_globe(x, y)
        above = z - self._autopilot.home_m[2]
        amsl = GROUND_AMSL_M + z - FEET_M
        return round(lat * 1e7), round(lon * 1e7), round(1000 * amsl), round(1000 * above)

    def _tell_heartbeat(self) -> None:
        d, pilot = self._d, self._autopilot
        mode = d.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | d.MAV_MODE_FLAG_STABILIZE_ENABLED
        mode |= d.MAV_MODE_FLAG_GUIDED_ENABLED if pilot.mode not in HOLDING else 0
        mode |= d.MAV_MODE_FLAG_SAFETY_ARMED if pilot.armed else 0
        status = d.MAV_STATE_STANDBY if pilot.landed else d.MAV_STATE_ACTIVE
        self._mav.heartbeat_send(
            d.MAV_TYPE_QUADROTOR, getattr(d, pilot.kind), mode, pilot.mode_number, status
        )

    def _tell_sys_status(self) -> None:
        d = self._d
        health = d.MAV_SYS_STATUS_SENSOR_GPS | d.MAV_SYS_STATUS_AHRS
        health |= d.MAV_SYS_STATUS_PREARM_CHECK
        self._mav.sys_status_send(health, health, health, 200, 12_600, 1_000, 90, 0, 0, 0, 0, 0, 0)

    def _tell_system_time(self) -> None:
        self._mav.system_time_send(1_700_000_000_000_000 + 1000 * self._ms, self._ms)

    def _tell_gps_raw_int(self) -> None:
        lat, lon, amsl, _ = self._place
        vn, ve, _ = self._velocity_ned
        course = round(100 * math.degrees(math.atan2(ve, vn)) % 36_000)
        fix = self._d.GPS_FIX_TYPE_3D_FIX
        speed = round(100 * math.hypot(vn, ve))
        self._mav.gps_raw_int_send(1000 * self._ms, fix, lat, lon, amsl, 80, 120, speed, course, 12)

    def _tell_ekf_status_report(self) -> None:
        self._mav.ekf_status_report_send(_EKF_GOOD, 0.1, 0.1, 0.1, 0.1, 0.0)

    def _tell_extended_sys_state(self) -> None:
        d, pilot = self._d, self._autopilot
        state = d.MAV_LANDED_STATE_ON_GROUND if pilot.landed else d.MAV_LANDED_STATE_IN_AIR
        if pilot.mode == "LAND" and not pilot.landed:
            state = d.MAV_LANDED_STATE_LANDING
        self._mav.extended_sys_state_send(d.MAV_VTOL_STATE_UNDEFINED, state)

    def _tell_home_position(self) -> None:
        x, y, z = self._autopilot.home_m
        lat, lon = on_globe(x, y)
        ox, oy, oz = self._autopilot.origin_m
        north, east, down = turned((x - ox, y - oy, z - oz))
        amsl = round(1000 * (GROUND_AMSL_M + z - FEET_M))
        self._mav.home_position_send(
            *(round(lat * 1e7), round(lon * 1e7), amsl, north, east, down),
            *([1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 1000 * self._ms),
        )

    def _tell_attitude(self) -> None:
        state = self._autopilot.now
        rates = flipped(state.angular_velocity_radps)
        self._mav.attitude_send(self._ms, *euler_of(state.attitude), *rates)

    def _tell_local_position_ned(self) -> None:
        place = self._autopilot.local_ned_m
        self._mav.local_position_ned_send(self._ms, *place, *self._velocity_ned)

    def _tell_global_position_int(self) -> None:
        vn, ve, vd = (round(100 * each) for each in self._velocity_ned)
        heading = round(100 * self._heading_deg) % 36_000
        self._mav.global_position_int_send(self._ms, *self._place, vn, ve, vd, heading)

    @property
    def _heading_deg(self) -> float:
        return math.degrees(euler_of(self._autopilot.now.attitude)[2]) % 360

    def _tell_vfr_hud(self) -> None:
        vn, ve, vd = self._velocity_ned
        speed = math.hypot(vn, ve)
        heading = round(self._heading_deg) % 360
        self._mav.vfr_hud_send(speed, speed, heading, 0, self._place[2] / 1000, -vd)

    def _tell_rangefinder(self) -> None:
        if self.rangefinder_m is not None:
            self._mav.rangefinder_send(self.rangefinder_m, 0.0)

    def _tell_distance_sensor(self) -> None:
        if self.rangefinder_m is not None:
            down, laser = self._d.MAV_SENSOR_ROTATION_PITCH_270, self._d.MAV_DISTANCE_SENSOR_LASER
            measured = round(100 * self.rangefinder_m)
            self._mav.distance_sensor_send(self._ms, 0, 12_000, measured, laser, 0, down, 0)

    # Messages from the program.

    def _on_command_long(self, m: Any) -> None:
        values = (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7)
        self._command(m, values, self._d.MAV_FRAME_GLOBAL_RELATIVE_ALT)

    def _on_command_int(self, m: Any) -> None:
        values = (m.param1, m.param2, m.param3, m.param4, m.x / 1e7, m.y / 1e7, m.z)
        self._command(m, values, m.frame)

    def _command(self, m: Any, values: tuple[float, ...], frame: int) -> None:
        d, used = self._d, _NUMBERS.get(m.command, ())
        if m.command == d.MAV_CMD_NAV_TAKEOFF and self._autopilot.kind == "MAV_AUTOPILOT_PX4":
            used = ()  # Without a height PX4 climbs as high as its parameter says.
        numbers = {f"param{index + 1}": values[index] for index in used}
        if used and self._refuse(d.enums["MAV_CMD"][m.command].name, numbers):
            return
        self._mav.command_ack_send(m.command, self._obey(m.command, values, frame))

    def _obey(self, command: int, p: tuple[float, ...], frame: int) -> int:
        d, pilot = self._d, self._autopilot
        done: bool | None = None
        if command == d.MAV_CMD_COMPONENT_ARM_DISARM:
            done = pilot.arm() if p[0] == 1 else pilot.disarm(force=p[1] == _FORCE)
        elif command == d.MAV_CMD_NAV_TAKEOFF:
            amsl = pilot.kind == "MAV_AUTOPILOT_PX4"
            done = pilot.take_off(p[6] - GROUND_AMSL_M if amsl else p[6])
        elif command == d.MAV_CMD_NAV_LAND:
            precise = pilot.kind == "MAV_AUTOPILOT_PX4" and p[1] >= 1
            done = pilot.set_mode("AUTO.PRECLAND" if precise else "LAND")
        elif command == d.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            done = pilot.set_mode("RTL")
        elif command == d.MAV_CMD_NAV_LOITER_UNLIM:
            done = pilot.set_mode("LOITER")
        elif command == d.MAV_CMD_DO_SET_MODE:
            done = pilot.set_mode(pilot.mode_of(p[1], p[2]))
        elif command == d.MAV_CMD_CONDITION_YAW:
            turn = math.radians(p[0]) * (-1 if p[3] and p[2] < 0 else 1)
            done = pilot.face(pilot.in_world_yaw(turn, relative=bool(p[3])))
        elif command == d.MAV_CMD_DO_CHANGE_SPEED and p[1] > 0:
            pilot.limit_speed(**{"up" if p[0] == 2 else "along": p[1]})
            done = True
        elif command == d.MAV_CMD_DO_REPOSITION:
            done = self._reposition(p, frame)
        elif command == d.MAV_CMD_SET_MESSAGE_INTERVAL:
            done = self._set_interval(int(p[0]), p[1] / 1e6)
        elif command == d.MAV_CMD_REQUEST_MESSAGE:
            done = self._tell_once(int(p[0]))
        elif command == d.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
            done = self._tell_version()
        elif command == d.MAV_CMD_GET_HOME_POSITION:
            self._tell_home_position()
            done = True
        if done is None:
            return int(d.MAV_RESULT_UNSUPPORTED)
        return int(d.MAV_RESULT_ACCEPTED if done else d.MAV_RESULT_FAILED)

    def _reposition(self, p: tuple[float, ...], frame: int) -> bool:
        if p[1] and int(p[1]) & 1 and not self._autopilot.set_mode("GUIDED"):
            return False
        return self._autopilot.go_to(self._world(p[4], p[5], p[6], frame))

    def _set_interval(self, message: int, every_s: float) -> bool:
        name = self._name_of(message)
        if name not in STREAMS:
            return False
        default = 1 / STREAMS[name]
        self._every_s[name] = default if every_s == 0 else max(every_s, 1 / MOST_HZ)
        if every_s < 0:
            self._every_s[name] = 0.0
        return True

    def _name_of(self, message: int) -> str:
        known = self._d.mavlink_map.get(message)
        return str(getattr(known, "msgname", "")) if known is not None else ""

    def _tell_once(self, message: int) -> bool:
        name = self._name_of(message)
        if name == "AUTOPILOT_VERSION":
            return self._tell_version()
        if name in STREAMS:
            self._tell(name)
        return name in STREAMS

    def _tell_version(self) -> bool:
        d, none = self._d, [0] * 8
        can = d.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | d.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        can |= d.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        can |= d.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        version = (4 << 24) | (5 << 16) | (7 << 8) | 255
        self._mav.autopilot_version_send(can, version, 0, 0, 0, none, none, none, 0, 0, 0)
        return True

    def _on_set_mode(self, m: Any) -> None:
        done = self._autopilot.set_mode(self._autopilot.mode_of(m.custom_mode))
        result = _ACCEPTED[0] if done else _ACCEPTED[1]
        # ArduPilot acknowledges this message by its own number, as if it were a command.
        self._mav.command_ack_send(m.get_msgId(), getattr(self._d, result))

    def _on_request_data_stream(self, m: Any) -> None:
        hz = min(float(m.req_message_rate), MOST_HZ) if m.start_stop else 0.0
        for name in STREAMS:
            if name != "HEARTBEAT" and (m.req_stream_id == 0 or name in _OF_STREAM):
                self._every_s[name] = 1 / hz if hz else 0.0

    def _on_set_position_target_local_ned(self, m: Any) -> None:
        d, pilot, frame = self._d, self._autopilot, m.coordinate_frame
        offset = frame in (d.MAV_FRAME_BODY_OFFSET_NED, d.MAV_FRAME_BODY_FRD)
        heading = offset or frame == d.MAV_FRAME_BODY_NED
        place, velocity, acceleration = self._parts(m, (m.x, m.y, m.z), ("x", "y", "z"))
        if place is not None:
            if offset or frame == d.MAV_FRAME_LOCAL_OFFSET_NED:
                place = _plus(pilot.now.position_m, pilot.in_world(place, heading=offset))
            else:
                place = _plus(pilot.origin_m, pilot.in_world(place))
        self._go(m, place, velocity, acceleration, heading=heading)

    def _on_set_position_target_global_int(self, m: Any) -> None:
        at = m.lat_int / 1e7, m.lon_int / 1e7, m.alt
        place, velocity, acceleration = self._parts(m, at, ("lat_int", "lon_int", "alt"))
        if place is not None:
            place = self._world(*place, m.coordinate_frame)
        self._go(m, place, velocity, acceleration, heading=False)

    def _parts(
        self, m: Any, place: Vector, names: tuple[str, str, str]
    ) -> tuple[Vector | None, Vector | None, Vector | None]:
        """Return what the type mask does not leave out; a part counts if none of it is left out."""
        values = (place, (m.vx, m.vy, m.vz), (m.afx, m.afy, m.afz))
        known = [
            None if m.type_mask & (0b111 << 3 * index) else each
            for index, each in enumerate(values)
        ]
        fields = names, ("vx", "vy", "vz"), ("afx", "afy", "afz")
        for each, of_part in zip(known, fields, strict=True):
            if each is not None:
                self._refuse(m.get_type(), dict(zip(of_part, each, strict=True)))
        return known[0], known[1], known[2]

    def _refuse(self, kind: str, numbers: Mapping[str, float]) -> bool:
        """Note a number that is not finite; return whether one was noted."""
        for name, each in numbers.items():
            if not math.isfinite(each):
                self.nonsense = self.nonsense or f"{kind} with {name} = {each}"
        return bool(self.nonsense)

    def _go(
        self,
        m: Any,
        place: Vector | None,
        velocity: Vector | None,
        acceleration: Vector | None,
        *,
        heading: bool,
    ) -> None:
        if self.nonsense:
            return
        pilot, mask = self._autopilot, m.type_mask
        yaw = rate = None
        if not mask & self._d.POSITION_TARGET_TYPEMASK_YAW_IGNORE and math.isfinite(m.yaw):
            yaw = pilot.in_world_yaw(m.yaw, relative=heading)
        if not mask & self._d.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE and yaw is None:
            rate = m.yaw_rate if math.isfinite(m.yaw_rate) else None
        pilot.go_to(
            place,
            velocity_mps=velocity and pilot.in_world(velocity, heading=heading),
            acceleration_mps2=acceleration and pilot.in_world(acceleration, heading=heading),
            yaw_rad=yaw,
            yaw_rate_radps=rate,
        )

    def _world(self, lat: float, lon: float, height: float, frame: int) -> Vector:
        d = self._d
        east, north = on_map(lat, lon)
        amsl = frame in (d.MAV_FRAME_GLOBAL, d.MAV_FRAME_GLOBAL_INT)
        above = height - GROUND_AMSL_M + FEET_M if amsl else height + self._autopilot.home_m[2]
        return east, north, above

    def _on_landing_target(self, m: Any) -> None:
        measured = getattr(m, "position_valid", 0) == 1
        names = ("x", "y", "z") if measured else ("angle_x", "angle_y", "distance")
        told = getattr(m, names[0]), getattr(m, names[1]), getattr(m, names[2])
        if self._refuse(m.get_type(), dict(zip(names, told, strict=True))):
            return
        if measured and m.frame == self._d.MAV_FRAME_LOCAL_NED:
            self._autopilot.target_at(self._autopilot.in_world(told))
            return
        direction = told if measured else (-math.tan(told[1]), math.tan(told[0]), 1.0)
        self._autopilot.landing_target(
            direction,
            distance_m=math.hypot(*direction) if measured else m.distance,
            rangefinder_m=self.rangefinder_m,
            level=m.frame == getattr(self._d, _LEVEL_FRAME),
        )

    def _on_mission_item(self, m: Any) -> None:
        """Take a goal of GUIDED: a mission item whose ``current`` is 2, as dronekit sends it."""
        self._item(m, (m.x, m.y, m.z))

    def _on_mission_item_int(self, m: Any) -> None:
        self._item(m, (m.x / 1e7, m.y / 1e7, m.z))

    def _item(self, m: Any, place: Vector) -> None:
        if self._refuse(m.get_type(), dict(zip("xyz", place, strict=True))):
            return
        taken = m.current == 2 and self._autopilot.go_to(self._world(*place, m.frame))
        result = self._d.MAV_MISSION_ACCEPTED if taken else self._d.MAV_MISSION_UNSUPPORTED
        self._mav.mission_ack_send(m.get_srcSystem(), m.get_srcComponent(), result)

    def _on_mission_request_list(self, m: Any) -> None:
        self._mav.mission_count_send(m.get_srcSystem(), m.get_srcComponent(), 1)

    def _on_mission_request(self, m: Any) -> None:
        d = self._d
        lat, lon = on_globe(*self._autopilot.home_m[:2])
        self._mav.mission_item_send(
            *(m.get_srcSystem(), m.get_srcComponent(), 0, d.MAV_FRAME_GLOBAL),
            *(d.MAV_CMD_NAV_WAYPOINT, 1, 1, 0.0, 0.0, 0.0, 0.0, lat, lon, GROUND_AMSL_M),
        )

    def _on_param_request_list(self, m: Any) -> None:
        del m
        values = [*self._autopilot.parameters.items()]
        for index, (name, value) in enumerate(values):
            self._tell_parameter(name, value, index, len(values))

    def _on_param_request_read(self, m: Any) -> None:
        values = [*self._autopilot.parameters.items()]
        names = [name for name, _ in values]
        index = m.param_index
        if index < 0:
            index = names.index(m.param_id) if m.param_id in names else -1
        if 0 <= index < len(values):
            name, value = values[index]
            self._tell_parameter(name, value, index, len(values))

    def _on_param_set(self, m: Any) -> None:
        if math.isfinite(m.param_value):
            self._autopilot.parameters.set(m.param_id, m.param_value)
        values = dict(self._autopilot.parameters.items())
        index = [*values].index(m.param_id) if m.param_id in values else 0
        self._tell_parameter(m.param_id, values.get(m.param_id, 0.0), index, len(values))

    def _tell_parameter(self, name: str, value: float, index: int, count: int) -> None:
        kind = self._d.MAV_PARAM_TYPE_REAL32
        self._mav.param_value_send(name.encode()[:16], value, kind, count, index)

    def _on_timesync(self, m: Any) -> None:
        if m.tc1 == 0:
            self._mav.timesync_send(1_000_000 * self._ms, m.ts1)


_OF_STREAM = tuple(name for name, hz in STREAMS.items() if hz >= 5)
"""What any of the old streams carries: they are not distinguished."""


def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
