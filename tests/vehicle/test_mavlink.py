"""MAVLink bytes: what the vehicle understands, and what it tells."""

from __future__ import annotations

import math
from typing import Any

import pytest

from pytest_garl.airframe import Airframe
from pytest_garl.landing_system import VehicleState
from pytest_garl.vehicle.autopilot import ArduCopter, Autopilot
from pytest_garl.vehicle.mavlink import MavlinkLink, dialect
from pytest_garl.vehicle.ned import ORIGIN_DEG, euler_of, heading_of, on_globe, on_map
from tests.companion.processes import mission

d = dialect()
YAW = math.radians(30)


class Ground:
    """The program's end of the link."""

    def __init__(self, height_m: float = 10.2) -> None:
        self.autopilot = Autopilot(Airframe(control_rate_hz=240), mission(), ArduCopter())
        self.data = b""
        self.link = MavlinkLink(self.autopilot, self._take)
        self.mav = d.MAVLink(self, srcSystem=255, srcComponent=190)
        state = VehicleState(
            time_s=0.0,
            position_m=(3.0, 4.0, height_m),
            velocity_mps=(1.0, 2.0, 3.0),
            attitude=(0.0, 0.0, math.sin(YAW / 2), math.cos(YAW / 2)),
            angular_velocity_radps=(0.1, 0.2, 0.3),
            thrusts_n=(0.0, 0.0, 0.0, 0.0),
        )
        self.autopilot.control(state)
        self.goals: list[Any] = []
        changed: Any = self.autopilot
        changed.go_to = self._goal

    def _take(self, data: bytes) -> None:
        self.data += data

    def _goal(self, place: Any, **more: Any) -> bool:
        self.goals.append((place, {key: each for key, each in more.items() if each is not None}))
        return True

    def write(self, data: bytes) -> None:
        """Give the vehicle what pymavlink has packed."""
        self.link.receive(bytes(data))

    def heard(self) -> dict[str, Any]:
        """Return the last message of each type that the vehicle has sent."""
        found = d.MAVLink(None).parse_buffer(self.data) or []
        self.data = b""
        return {each.get_type(): each for each in found}

    def local(self, frame: int, mask: int, *values: float) -> Any:
        self.goals.clear()
        fields = (*values, *(0.0,) * (11 - len(values)))
        self.mav.set_position_target_local_ned_send(0, 1, 1, frame, mask, *fields)
        return self.goals[-1]


POSITION, VELOCITY = 0b110111111000, 0b110111000111


def test_frames_turn_into_each_other() -> None:
    assert on_globe(0.0, 0.0) == ORIGIN_DEG
    assert on_map(*on_globe(12.5, -7.25)) == pytest.approx((12.5, -7.25), abs=1e-6)
    assert heading_of(heading_of(0.3)) == pytest.approx(0.3)
    # Nose up by 0.1 rad and right side down by 0.2, facing east.
    half = 0.1
    assert euler_of((math.sin(half), 0.0, 0.0, math.cos(half))) == pytest.approx(
        (0.2, 0.0, math.pi / 2)
    )
    half = -0.05
    assert euler_of((0.0, math.sin(half), 0.0, math.cos(half))) == pytest.approx(
        (0.0, 0.1, math.pi / 2)
    )


def test_it_tells_its_state_in_ned_and_on_the_globe() -> None:
    ground = Ground()
    ground.link.rangefinder_m = 9.5
    ground.link.tell()
    heard = ground.heard()
    beat = heard["HEARTBEAT"]
    assert (beat.custom_mode, beat.autopilot) == (4, d.MAV_AUTOPILOT_ARDUPILOTMEGA)
    assert beat.base_mode & d.MAV_MODE_FLAG_SAFETY_ARMED
    here = heard["LOCAL_POSITION_NED"]
    assert (here.x, here.y, here.z) == pytest.approx((2.0, 2.0, -10.0))
    assert (here.vx, here.vy, here.vz) == pytest.approx((2.0, 1.0, -3.0))
    attitude = heard["ATTITUDE"]
    assert (attitude.roll, attitude.pitch) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert attitude.yaw == pytest.approx(math.radians(60))
    assert attitude.rollspeed == pytest.approx(0.1)
    assert attitude.yawspeed == pytest.approx(-0.3)
    globe = heard["GLOBAL_POSITION_INT"]
    assert on_map(globe.lat / 1e7, globe.lon / 1e7) == pytest.approx((3.0, 4.0), abs=0.02)
    assert (globe.relative_alt, globe.alt, globe.hdg) == (10_000, 594_000, 6_000)
    assert heard["DISTANCE_SENSOR"].current_distance == 950


def test_local_setpoints_act_in_each_of_their_frames() -> None:
    ground = Ground()
    yaw_free = POSITION
    place, _ = ground.local(d.MAV_FRAME_LOCAL_NED, yaw_free, 5.0, 6.0, -7.0)
    assert place == pytest.approx((1.0 + 6.0, 2.0 + 5.0, 7.2))
    place, _ = ground.local(d.MAV_FRAME_LOCAL_OFFSET_NED, yaw_free, 5.0, 6.0, -7.0)
    assert place == pytest.approx((9.0, 9.0, 17.2))
    c, s = math.cos(YAW), math.sin(YAW)
    # 2 m ahead and 1 m to the right.
    place, _ = ground.local(d.MAV_FRAME_BODY_OFFSET_NED, yaw_free, 2.0, 1.0, 0.5)
    assert place == pytest.approx((3.0 + 2 * c + s, 4.0 + 2 * s - c, 9.7))
    place, more = ground.local(d.MAV_FRAME_BODY_NED, VELOCITY, 0, 0, 0, 2.0, 1.0, 0.5)
    assert place is None
    assert more["velocity_mps"] == pytest.approx((2 * c + s, 2 * s - c, -0.5))
    _, more = ground.local(d.MAV_FRAME_LOCAL_NED, VELOCITY, 0, 0, 0, 2.0, 1.0, 0.5)
    assert more["velocity_mps"] == pytest.approx((1.0, 2.0, -0.5))


def test_a_yaw_is_a_heading_or_relative_in_frames_of_the_body() -> None:
    ground = Ground()
    values = (0.0,) * 9 + (math.radians(90),)
    _, more = ground.local(d.MAV_FRAME_LOCAL_NED, POSITION & ~0x400, *values)
    assert more["yaw_rad"] == pytest.approx(0.0, abs=1e-6)
    _, more = ground.local(d.MAV_FRAME_BODY_OFFSET_NED, POSITION & ~0x400, *values)
    assert more["yaw_rad"] == pytest.approx(YAW - math.radians(90))
    _, more = ground.local(d.MAV_FRAME_LOCAL_NED, VELOCITY & ~0x800, *(0.0,) * 10, 0.5)
    assert more["yaw_rate_radps"] == pytest.approx(0.5)


def test_global_setpoints_and_guided_waypoints_lead_to_one_place() -> None:
    ground = Ground()
    lat, lon = on_globe(20.0, -10.0)
    ground.mav.set_position_target_global_int_send(
        *(0, 1, 1, d.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, POSITION),
        *(round(lat * 1e7), round(lon * 1e7), 8.0, 0, 0, 0, 0, 0, 0, 0, 0),
    )
    ground.mav.mission_item_int_send(
        *(1, 1, 0, d.MAV_FRAME_GLOBAL, d.MAV_CMD_NAV_WAYPOINT, 2, 0, 0, 0, 0, 0),
        *(round(lat * 1e7), round(lon * 1e7), 592.0),
    )
    for place, _ in ground.goals:
        assert place == pytest.approx((20.0, -10.0, 8.2), abs=0.02)
    assert ground.heard()["MISSION_ACK"].type == d.MAV_MISSION_ACCEPTED


def test_commands_are_acknowledged_as_they_are_obeyed() -> None:
    ground = Ground()

    def asked(command: int, *p: float) -> int:
        ground.mav.command_long_send(1, 1, command, 0, *p, *(0.0,) * (7 - len(p)))
        answer = ground.heard()["COMMAND_ACK"]
        assert answer.command == command
        return int(answer.result)

    accepted, failed = d.MAV_RESULT_ACCEPTED, d.MAV_RESULT_FAILED
    assert asked(d.MAV_CMD_COMPONENT_ARM_DISARM, 1) == accepted
    assert asked(d.MAV_CMD_COMPONENT_ARM_DISARM, 0) == failed
    assert asked(d.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 5) == failed
    assert asked(d.MAV_CMD_CONDITION_YAW, 90, 0, 1, 0) == accepted
    assert asked(d.MAV_CMD_DO_CHANGE_SPEED, 1, 3.5) == accepted
    assert ground.autopilot.parameters["WPNAV_SPEED"] == 350
    assert asked(d.MAV_CMD_DO_SET_MODE, 1, 9) == accepted
    assert ground.autopilot.mode == "LAND"
    assert asked(d.MAV_CMD_DO_SET_MODE, 1, 99) == failed
    assert asked(d.MAV_CMD_DO_DIGICAM_CONTROL) == d.MAV_RESULT_UNSUPPORTED
    ground.mav.set_mode_send(1, 1, 4)
    assert ground.heard()["COMMAND_ACK"].result == accepted
    assert ground.autopilot.mode == "GUIDED"


def test_rates_follow_what_was_asked() -> None:
    ground = Ground()
    interval = d.MAV_CMD_SET_MESSAGE_INTERVAL
    ground.mav.command_long_send(1, 1, interval, 0, 30, 20_000, 0, 0, 0, 0, 0)
    ground.mav.command_long_send(1, 1, interval, 0, 32, -1, 0, 0, 0, 0, 0)
    counts = {"ATTITUDE": 0, "LOCAL_POSITION_NED": 0, "VFR_HUD": 0}
    for tick in range(50):
        ground.autopilot.state = _later(ground.autopilot.now, tick / 50)
        ground.link.tell()
        for name in ground.heard():
            counts[name] = counts.get(name, 0) + 1
    assert (counts["ATTITUDE"], counts["LOCAL_POSITION_NED"], counts["VFR_HUD"]) == (50, 0, 10)
    ground.mav.request_data_stream_send(1, 1, 0, 2, 1)
    assert not ground.link.nonsense


def _later(state: VehicleState, time_s: float) -> VehicleState:
    return VehicleState(
        time_s=time_s,
        position_m=state.position_m,
        velocity_mps=state.velocity_mps,
        attitude=state.attitude,
        angular_velocity_radps=state.angular_velocity_radps,
        thrusts_n=state.thrusts_n,
    )


def test_parameters_have_ardupilots_names_and_units() -> None:
    ground = Ground()
    ground.mav.param_request_read_send(1, 1, b"WPNAV_SPEED", -1)
    assert ground.heard()["PARAM_VALUE"].param_value == 1000
    ground.mav.param_set_send(1, 1, b"LAND_SPEED", 30, d.MAV_PARAM_TYPE_REAL32)
    answer = ground.heard()["PARAM_VALUE"]
    assert (answer.param_id, answer.param_value) == ("LAND_SPEED", 30)
    assert ground.autopilot.parameters.flown.land_speed == pytest.approx(0.3)
    ground.mav.param_set_send(1, 1, b"ATC_RAT_YAW_P", 0.5, d.MAV_PARAM_TYPE_REAL32)
    assert ground.autopilot.parameters.flown.atc_rat_yaw.p == 0.5
    ground.mav.param_set_send(1, 1, b"FS_GCS_ENABLE", 1, d.MAV_PARAM_TYPE_REAL32)
    assert ground.heard()["PARAM_VALUE"].param_id == "FS_GCS_ENABLE"
    ground.mav.param_request_list_send(1, 1)
    found = list(d.MAVLink(None).parse_buffer(ground.data))
    assert len(found) == found[0].param_count > 60
    assert [each.param_index for each in found] == [*range(len(found))]


def test_garbage_and_messages_for_others_are_left_out() -> None:
    ground = Ground()
    ground.link.receive(bytes(range(200)) * 4)
    assert not ground.link.heard
    ground.mav.set_mode_send(7, 1, 9)
    assert ground.autopilot.mode == "GUIDED"
    ground.mav.set_mode_send(1, 1, 9)
    assert str(ground.autopilot.mode) == "LAND"


def test_a_number_that_is_none_is_named() -> None:
    ground = Ground()
    ground.mav.landing_target_send(0, 0, d.MAV_FRAME_BODY_FRD, math.nan, 0.0, 1.0, 0.0, 0.0)
    assert ground.link.nonsense == "LANDING_TARGET with angle_x = nan"
    assert ground.autopilot.target_m is None


@pytest.mark.parametrize(
    ("command", "values", "name"),
    [
        (d.MAV_CMD_NAV_TAKEOFF, [0.0] * 6 + [math.nan], "MAV_CMD_NAV_TAKEOFF with param7"),
        (d.MAV_CMD_DO_REPOSITION, [0.0] * 4 + [math.nan] * 3, "MAV_CMD_DO_REPOSITION with param5"),
        (
            d.MAV_CMD_SET_MESSAGE_INTERVAL,
            [math.nan] * 7,
            "MAV_CMD_SET_MESSAGE_INTERVAL with param1",
        ),
    ],
)
def test_a_command_whose_number_is_none_is_named(
    command: int, values: list[float], name: str
) -> None:
    ground = Ground()
    ground.mav.command_long_send(1, 1, command, 0, *values)
    assert ground.link.nonsense == f"{name} = nan"


def test_a_number_that_a_command_does_not_use_may_be_none() -> None:
    ground = Ground()
    ground.mav.command_long_send(1, 1, d.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1.0, *[math.nan] * 6)
    assert ground.link.nonsense == ""
    assert ground.autopilot.armed
