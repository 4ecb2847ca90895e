"""PX4's modes: OFFBOARD and the loss of its setpoints, take-off, and precision landing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from pytest_garl.airframe import Airframe
from pytest_garl.errors import LandingSystemError
from pytest_garl.vehicle.mavlink import MavlinkLink, dialect
from pytest_garl.vehicle.px4 import Px4Autopilot, Px4Copter
from tests.support.bare_flight import Trace, fly_bare
from tests.vehicle.test_autopilot import at, at_origin

d = dialect()


def flown(
    orders: Callable[[float, Px4Autopilot], None],
    seconds: float,
    vehicle: Px4Copter | None = None,
    start_m: float = 0.0,
) -> tuple[Trace, Px4Autopilot]:
    made: list[Px4Autopilot] = []

    def make(airframe: Airframe) -> Any:
        made.append((vehicle or Px4Copter()).autopilot(airframe, at_origin()))
        return made[0]

    def order(time_s: float, pilot: Px4Autopilot) -> None:
        if pilot.state is not None:
            orders(time_s, pilot)

    return fly_bare(order, seconds, make=make, start_m=start_m), made[0]


def test_offboard_needs_a_stream_and_takes_off_by_its_setpoints() -> None:
    entered: list[bool] = []

    def orders(time_s: float, pilot: Px4Autopilot) -> None:
        if not pilot.armed:
            entered.append(pilot.set_mode("OFFBOARD"))
        if time_s > 0.5:
            pilot.go_to((0.0, 2.0, 3.2), yaw_rad=0.0)
        if time_s > 1.0:
            pilot.arm()

    trace, pilot = flown(orders, 12.0)
    assert entered[0] is False
    assert entered[-1] is True
    assert pilot.mode == "OFFBOARD"
    assert trace.position_m[-1] == pytest.approx((0.0, 2.0, 3.2), abs=0.15)


@pytest.mark.parametrize(("action", "mode"), [(0, "POSCTL"), (4, "AUTO.LAND")])
def test_the_loss_of_setpoints_ends_offboard(action: int, mode: str) -> None:
    def orders(time_s: float, pilot: Px4Autopilot) -> None:
        if time_s < 4.0:
            pilot.go_to(None, velocity_mps=(1.0, 0.0, 0.0))
            pilot.set_mode("OFFBOARD")

    vehicle = Px4Copter(parameters={"COM_OBL_RC_ACT": action, "COM_OF_LOSS_T": 0.5})
    trace, pilot = flown(orders, 4.4, vehicle, 6.0)
    assert pilot.mode == "OFFBOARD"
    trace, pilot = flown(orders, 9.0, vehicle, 6.0)
    assert pilot.mode == mode
    assert "Failsafe: offboard control lost" in pilot.told
    assert abs(trace.velocity_mps[-1, 0]) < 0.1
    assert (trace.position_m[-1, 2] < 4.0) == (mode == "AUTO.LAND")


def test_take_off_climbs_and_loiters() -> None:
    _, pilot = flown(
        at({0.1: lambda pilot: pilot.arm(), 0.2: lambda pilot: pilot.take_off(math.nan)}), 9.0
    )
    assert pilot.mode == "AUTO.LOITER"
    assert pilot.height_m == pytest.approx(2.5, abs=0.3)


def test_precision_landing_comes_down_on_the_target() -> None:
    target = (1.5, -1.0, 0.0)

    def orders(time_s: float, pilot: Px4Autopilot) -> None:
        pilot.target_at(target)
        if time_s > 0.1:
            pilot.set_mode("AUTO.PRECLAND")

    trace, pilot = flown(orders, 25.0, start_m=5.0)
    assert trace.position_m[-1, :2] == pytest.approx(target[:2], abs=0.2)
    assert not pilot.armed


def test_without_a_target_it_searches_and_then_lands() -> None:
    vehicle = Px4Copter(parameters={"PLD_SRCH_ALT": 6, "PLD_SRCH_TOUT": 3, "PLD_MAX_SRCH": 1})
    trace, pilot = flown(
        at({0.1: lambda pilot: pilot.set_mode("AUTO.PRECLAND")}), 25.0, vehicle, 3.0
    )
    assert trace.position_m[:, 2].max() == pytest.approx(6.2, abs=0.2)
    assert not pilot.armed


def test_the_pilot_switches_to_precision_landing() -> None:
    _, pilot = flown(at({}), 14.0, Px4Copter(pilot="LAND"))
    assert pilot.mode == "AUTO.PRECLAND"


def test_its_modes_have_px4s_numbers() -> None:
    _, pilot = flown(at({}), 0.1, start_m=3.0)
    sent: list[bytes] = []
    link = MavlinkLink(pilot, sent.append)
    link.tell()
    messages = d.MAVLink(None).parse_buffer(b"".join(sent))
    beat = next(each for each in messages if each.get_type() == "HEARTBEAT")
    assert (beat.autopilot, beat.custom_mode) == (d.MAV_AUTOPILOT_PX4, 4 << 16 | 3 << 24)
    assert pilot.mode_of(4, 6) == "AUTO.LAND"
    assert pilot.mode_of(6 << 16) == "OFFBOARD"
    assert pilot.mode_of(9) == ""
    pilot.parameters.set("MPC_LAND_SPEED", 0.4)
    assert pilot.parameters["MPC_LAND_SPEED"] == 0.4
    assert pilot.parameters.flown.land_speed == pytest.approx(0.4)


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(LandingSystemError, match="found LAND_SPEED = 1; expected a finite number"):
        Px4Copter(parameters={"LAND_SPEED": 1})


def test_a_mode_that_no_pilot_switches_to_is_refused() -> None:
    with pytest.raises(LandingSystemError, match="pilot = 'POSCTL': expected 'LAND' or 'LOITER'"):
        Px4Copter(pilot="POSCTL")  # type: ignore[arg-type]
