"""ArduPilot's modes over its flight control, flown in an empty world."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from pytest_garl.airframe import Airframe
from pytest_garl.landing_system import Abort, Diagnostics, Land, Mission, PositionSetpoint
from pytest_garl.vehicle.autopilot import ArduCopter, Autopilot
from tests.companion.processes import mission
from tests.support.bare_flight import Trace, fly_bare


def at_origin(marker_m: tuple[float, float] = (6.0, 3.0)) -> Mission:
    given = mission()
    return Mission(
        gps_position_m=marker_m,
        home_m=(0.0, 0.0, 0.2),
        search_altitude_m=5.0,
        marker_id=given.marker_id,
        marker_side_m=given.marker_side_m,
        marker_dictionary=given.marker_dictionary,
        camera=given.camera,
        time_limit_s=60.0,
    )


def flown(
    orders: Callable[[float, Autopilot], None],
    seconds: float,
    vehicle: ArduCopter | None = None,
    start_m: float = 0.0,
    marker_m: tuple[float, float] = (6.0, 3.0),
) -> tuple[Trace, Autopilot]:
    made: list[Autopilot] = []

    def make(airframe: Airframe) -> Any:
        made.append(Autopilot(airframe, at_origin(marker_m), vehicle or ArduCopter()))
        return made[0]

    def order(time_s: float, pilot: Autopilot) -> None:
        if pilot.state is not None:
            orders(time_s, pilot)

    return fly_bare(order, seconds, make=make, start_m=start_m), made[0]


def at(times: dict[float, Callable[[Autopilot], object]]) -> Callable[[float, Autopilot], None]:
    """Return orders that are given once each, at the times."""
    left = dict(sorted(times.items()))

    def orders(time_s: float, pilot: Autopilot) -> None:
        for due in [each for each in left if each <= time_s]:
            left.pop(due)(pilot)

    return orders


def test_it_takes_off_armed_and_in_guided_only() -> None:
    answers: list[bool] = []

    def try_take_off(pilot: Autopilot) -> None:
        answers.append(pilot.take_off(4.0))

    trace, pilot = flown(
        at(
            {
                0.1: try_take_off,
                0.2: lambda pilot: pilot.arm(),
                0.3: try_take_off,
                0.4: lambda pilot: pilot.set_mode("GUIDED"),
                0.5: try_take_off,
            }
        ),
        9.0,
    )
    assert answers == [False, False, True]
    assert pilot.armed
    assert pilot.height_m == pytest.approx(4.0, abs=0.1)
    assert trace.position_m[-1, :2] == pytest.approx((0.0, 0.0), abs=0.05)
    assert pilot.local_ned_m[2] == pytest.approx(-4.0, abs=0.1)


def test_it_disarms_by_itself_if_nothing_takes_off() -> None:
    _, pilot = flown(at({0.1: lambda pilot: pilot.arm()}), 9.0)
    assert pilot.armed
    _, pilot = flown(at({0.1: lambda pilot: pilot.arm()}), 10.5)
    assert not pilot.armed
    assert pilot.told == ["Arming motors", "Disarming motors"]


def test_a_goal_far_away_turns_the_nose_and_one_nearby_does_not() -> None:
    trace, pilot = flown(at({0.1: lambda pilot: pilot.go_to((0.0, 6.0, 8.0))}), 8.0, start_m=8.0)
    assert trace.position_m[-1] == pytest.approx((0.0, 6.0, 8.0), abs=0.1)
    assert trace.yaw_rad[-1] == pytest.approx(math.pi / 2, abs=0.03)
    assert pilot.mode == "GUIDED"
    trace, _ = flown(at({0.1: lambda pilot: pilot.go_to((0.0, 1.5, 8.0))}), 5.0, start_m=8.0)
    assert trace.yaw_rad[-1] == pytest.approx(0.0, abs=0.02)
    keeps = ArduCopter(parameters={"WP_YAW_BEHAVIOR": 0})
    trace, _ = flown(at({0.1: lambda pilot: pilot.go_to((0.0, 6.0, 8.0))}), 4.0, keeps, 8.0)
    assert trace.yaw_rad[-1] == pytest.approx(0.0, abs=0.02)


def test_velocities_and_yaw_rates_end_if_they_are_not_renewed() -> None:
    def order(pilot: Autopilot) -> None:
        pilot.go_to(None, velocity_mps=(1.0, 0.0, 0.0), yaw_rate_radps=0.3)

    trace, _ = flown(at({0.1: order}), 7.0, start_m=8.0)
    # For the 3 s of GUID_TIMEOUT, then it stops.
    assert 2.0 < trace.position_m[-1, 0] < 4.0
    assert abs(trace.velocity_mps[-1, 0]) < 0.1
    # To the right: NED's positive rate, seen from above.
    assert trace.yaw_rad[-1] == pytest.approx(-0.9, abs=0.1)


def test_land_comes_down_and_disarms_and_says_so_in_the_record() -> None:
    def record(pilot: Autopilot) -> Any:
        return pilot.command(Diagnostics())

    _, pilot = flown(at({0.1: lambda pilot: pilot.set_mode("LAND")}), 1.0, start_m=3.0)
    assert isinstance(record(pilot), Land)
    _, pilot = flown(at({0.1: lambda pilot: pilot.set_mode("LAND")}), 12.0, start_m=3.0)
    assert pilot.landed
    assert not pilot.armed
    assert isinstance(record(pilot), Land)
    _, pilot = flown(at({}), 0.2, start_m=3.0)
    assert isinstance(record(pilot), PositionSetpoint)


def test_it_lands_on_the_target_that_it_is_told() -> None:
    # 1.5 m ahead of a vehicle that faces east, and 1 m to its right.
    target = (1.5, -1.0, 0.2)

    def orders(time_s: float, pilot: Autopilot) -> None:
        if time_s > 0.1:
            pilot.set_mode("LAND")
        x, y, z = pilot.now.position_m
        seen = (target[0] - x, -(target[1] - y), z - target[2])
        if seen[2] > 0.1:
            pilot.landing_target(seen, distance_m=math.hypot(*seen), rangefinder_m=None, level=True)

    vehicle = ArduCopter(parameters={"PLND_ENABLED": 1})
    trace, pilot = flown(orders, 20.0, vehicle, 5.0)
    assert pilot.landed
    assert trace.position_m[-1, :2] == pytest.approx(target[:2], abs=0.1)
    trace, _ = flown(orders, 20.0, None, 5.0)
    assert trace.position_m[-1, :2] == pytest.approx((0.0, 0.0), abs=0.1)


def test_a_target_without_a_distance_needs_a_rangefinder() -> None:
    _, pilot = flown(at({}), 0.2, start_m=5.0)
    pilot.landing_target((0.1, 0.0, 1.0), distance_m=0.0, rangefinder_m=None, level=False)
    assert pilot.target_m is None
    pilot.landing_target((0.1, 0.0, 1.0), distance_m=0.0, rangefinder_m=4.0, level=False)
    assert pilot.target_m == pytest.approx((0.4, 0.0, 1.0), abs=0.05)
    pilot.landing_target((math.nan, 0.0, 1.0), distance_m=1.0, rangefinder_m=4.0, level=False)
    assert pilot.target_m == pytest.approx((0.4, 0.0, 1.0), abs=0.05)


def test_rtl_climbs_returns_and_lands() -> None:
    vehicle = ArduCopter(parameters={"RTL_ALT": 600, "RTL_LOIT_TIME": 4000})

    def orders(time_s: float, pilot: Autopilot) -> None:
        if time_s < 4.0:
            pilot.go_to((4.0, 0.0, 4.0))
        else:
            pilot.set_mode("RTL")

    trace, pilot = flown(orders, 36.0, vehicle, 4.0)
    assert trace.position_m[:, 2].max() == pytest.approx(6.2, abs=0.2)
    assert trace.position_m[-1, :2] == pytest.approx((0.0, 0.0), abs=0.2)
    assert not pilot.armed


@pytest.mark.parametrize(("marker_m", "gives_up"), [((12.0, 0.0), True), ((6.0, 3.0), False)])
def test_to_be_back_home_is_to_have_given_up_where_no_marker_can_be(
    marker_m: tuple[float, float], gives_up: bool
) -> None:
    said: list[type] = []

    def orders(time_s: float, pilot: Autopilot) -> None:
        if time_s < 2.0:
            pilot.go_to((4.0, 0.0, 4.0))
        else:
            pilot.set_mode("RTL")
        said.append(type(pilot.command(Diagnostics())))

    _, pilot = flown(orders, 14.0, ArduCopter(parameters={"RTL_ALT": 600}), 4.0, marker_m)
    assert pilot.returns_since_s == pytest.approx(2.0, abs=0.1)
    pilot.set_mode("LOITER")
    assert pilot.returns_since_s is None
    assert said[0] is PositionSetpoint
    assert (Abort in said) == gives_up


def test_the_pilot_flies_to_the_coordinate_and_switches_to_land() -> None:
    trace, pilot = flown(at({}), 30.0, ArduCopter(pilot="LAND"))
    assert trace.position_m[:, 2].max() == pytest.approx(5.2, abs=0.2)
    assert trace.position_m[-1, :2] == pytest.approx((6.0, 3.0), abs=0.3)
    assert pilot.mode == "LAND"
    assert not pilot.armed


def test_other_modes_hold_and_unknown_ones_are_refused() -> None:
    _, pilot = flown(at({0.1: lambda pilot: pilot.set_mode("LOITER")}), 3.0, start_m=4.0)
    assert pilot.now.position_m == pytest.approx((0.0, 0.0, 4.0), abs=0.1)
    assert not pilot.go_to((5.0, 0.0, 4.0))
    assert not pilot.set_mode("AUTO")
    assert not pilot.set_mode("DRIFT")
    assert not pilot.disarm()
    assert pilot.disarm(force=True)
