from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from landing_systems.modules.control_ardupilot import (
    ArduPilotControl,
    ArduPilotParameters,
    tuned,
    vehicle_of,
)
from landing_systems.modules.control_ardupilot.attitude import AttitudeControl
from landing_systems.modules.control_ardupilot.descent import (
    descent_rate,
    descent_rate_over_target,
)
from landing_systems.modules.control_ardupilot.filters import smoothing
from landing_systems.modules.control_ardupilot.guidance import ZERO, Setpoint
from landing_systems.modules.control_ardupilot.land_detector import LandDetector
from landing_systems.modules.control_ardupilot.mixer import Shares, mixed
from landing_systems.modules.control_ardupilot.pid import Pid
from landing_systems.modules.control_ardupilot.position import HorizontalControl
from landing_systems.modules.control_ardupilot.rotations import (
    between,
    heading_quaternion,
    rotated,
    tilt_and_turn,
    yaw_of,
)
from landing_systems.modules.control_ardupilot.shaping import (
    ShapedAxis,
    ShapedPlane,
    sqrt_controller,
    stopping_distance,
)
from landing_systems.modules.control_ardupilot.spool import Spool
from pytest_garl import Airframe, VehicleState

DT = 1 / 240
P = ArduPilotParameters()


# Shaping


@pytest.mark.parametrize(
    ("error", "rate"),
    [
        (0.0, 0.0),
        (1.0, 2.0),  # linear up to limit / p² = 1.25
        (1.25, 2.5),
        (5.0, math.sqrt(2 * 5 * (5 - 0.625))),
        (-5.0, -math.sqrt(43.75)),
    ],
)
def test_the_sqrt_controller_is_linear_then_a_square_root(error: float, rate: float) -> None:
    assert sqrt_controller(2.0, 5.0)(error) == pytest.approx(rate)


def test_the_sqrt_controller_brakes_with_no_more_than_its_limit() -> None:
    rate, error, before, hardest = sqrt_controller(1.0, 2.5), 20.0, None, 0.0
    while error > 0.01:
        speed = rate(error)
        if before is not None:
            hardest = max(hardest, (before - speed) / DT)
        before = speed
        error -= speed * DT
    assert 2.3 < hardest < 2.52


@pytest.mark.parametrize("speed", [0.0, 0.4, 2.5, 9.0])
def test_the_stopping_distance_is_the_inverse_of_the_sqrt_controller(speed: float) -> None:
    assert sqrt_controller(1.0, 2.5)(stopping_distance(speed, 1.0, 2.5)) == pytest.approx(speed)


def test_a_shaped_axis_keeps_its_limits_and_arrives() -> None:
    axis = ShapedAxis(1.0, 5.0, DT)
    before, fastest, hardest, jerk = 0.0, 0.0, 0.0, 0.0
    for _ in range(round(18 / DT)):
        axis.towards(20.0, 0.0, -1.5, 2.5)
        fastest, hardest = max(fastest, axis.velocity), max(hardest, abs(axis.acceleration))
        jerk = max(jerk, abs(axis.acceleration - before) / DT)
        before = axis.acceleration
    assert fastest == pytest.approx(2.5, abs=0.01)
    assert hardest <= 1.0 + 1e-9
    assert jerk <= 5.0 + 1e-6
    assert axis.position == pytest.approx(20.0, abs=0.005)


def test_a_shaped_plane_is_no_faster_on_the_diagonal() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    fastest = 0.0
    for _ in range(round(26 / DT)):
        plane.towards((30.0, 40.0), top=3.0)
        fastest = max(fastest, math.hypot(*plane.velocity))
    assert 2.98 < fastest < 3.05
    assert plane.position == pytest.approx((30.0, 40.0), abs=0.05)


def test_a_shaped_plane_follows_a_moving_goal_without_lag() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    for step in range(round(15 / DT)):
        plane.towards((step * DT, 0.0), (1.0, 0.0), top=10.0)
    assert plane.position[0] == pytest.approx(15.0, abs=0.02)


def test_a_shaped_plane_stops_at_its_stopping_point_without_turning_back() -> None:
    plane = ShapedPlane(2.5, 5.0, DT)
    plane.reset((1.0, 2.0), (3.0, 0.0))
    goal = plane.stopping_point()
    backwards = 0.0
    for _ in range(round(10 / DT)):
        plane.towards(goal, top=10.0)
        backwards = min(backwards, plane.velocity[0])
    assert plane.position == pytest.approx(goal, abs=0.01)
    assert backwards > -0.25


# PID


def test_a_pid_adds_its_three_parts() -> None:
    pid = Pid(2.0, 0.5, 0.1, 10.0, dt_s=0.01)
    assert pid.update(1.0, 0.0, False) == pytest.approx(2.0 + 0.005)  # no derivative at first
    assert pid.update(1.0, 0.2, False) == pytest.approx(1.6 + 0.009 - 0.1 * 0.2 / 0.01)


def test_a_first_order_filter_passes_63_percent_after_its_time_constant() -> None:
    cutoff, value = 2.5, 0.0
    for _ in range(round(1 / (2 * math.pi * cutoff) / 1e-4)):
        value += smoothing(cutoff, 1e-4) * (1.0 - value)
    assert value == pytest.approx(1 - math.exp(-1), abs=0.002)
    assert smoothing(0.0, DT) == 1.0


def test_the_integral_stays_within_imax() -> None:
    pid = Pid(0.0, 1.0, 0.0, 0.5, dt_s=0.1)
    outputs = [pid.update(1.0, 0.0, False) for _ in range(20)]
    assert outputs[3] == pytest.approx(0.4)
    assert outputs[-1] == 0.5


def test_a_limited_integral_may_only_shrink() -> None:
    pid = Pid(0.0, 1.0, 0.0, 5.0, dt_s=0.1)
    pid.update(1.0, 0.0, False)
    assert pid.update(1.0, 0.0, True) == pytest.approx(0.1)
    assert pid.update(-0.5, 0.0, True) == pytest.approx(0.05)


def test_the_horizontal_integral_does_not_wind_up_at_the_lean_limit() -> None:
    control = HorizontalControl(P, DT)
    control.target.reset((100.0, 0.0))
    most = 9.80665 * math.tan(math.radians(30))
    for _ in range(240 * 20):
        ax, ay = control.acceleration((0.0, 0.0), (0.0, 0.0))
        assert math.hypot(ax, ay) <= most + 1e-9
    control.target.reset((0.0, 0.0))
    for _ in range(240):
        ax, _ = control.acceleration((0.0, 0.0), (0.0, 0.0))
    assert ax < 1.0


# Mixer


def mix(roll: float, pitch: float, yaw: float, throttle: float, best: float = 0.5) -> Shares:
    return mixed(roll, pitch, yaw, throttle, average_max=best, yaw_headroom=0.2)[0]


def test_the_mixer_spreads_each_axis_over_the_right_motors() -> None:
    assert mix(0.0, 0.0, 0.0, 0.3) == pytest.approx((0.3, 0.3, 0.3, 0.3))
    assert mix(0.2, 0.0, 0.0, 0.5) == pytest.approx((0.6, 0.4, 0.4, 0.6))
    assert mix(0.0, 0.2, 0.0, 0.5) == pytest.approx((0.4, 0.4, 0.6, 0.6))
    assert mix(0.0, 0.0, 0.2, 0.5) == pytest.approx((0.4, 0.6, 0.4, 0.6))


def test_roll_comes_before_the_throttle() -> None:
    shares, limits = mixed(0.6, 0.0, 0.0, 0.1, average_max=0.4, yaw_headroom=0.2)
    assert shares == pytest.approx((0.6, 0.0, 0.0, 0.6))
    assert not limits.tilt
    shares, limits = mixed(0.6, 0.0, 0.0, 0.95, average_max=0.95, yaw_headroom=0.2)
    assert shares == pytest.approx((1.0, 0.4, 0.4, 1.0))
    assert limits.upper


def test_the_throttle_is_raised_no_further_than_its_level_allows() -> None:
    shares, limits = mixed(1.0, 0.0, 0.0, 0.0, average_max=0.1, yaw_headroom=0.2)
    assert shares == pytest.approx((0.2, 0.0, 0.0, 0.2))
    assert limits.tilt
    assert limits.lower


def test_roll_comes_before_yaw_but_yaw_keeps_its_headroom() -> None:
    shares, limits = mixed(0.8, 0.0, 1.0, 0.5, average_max=0.5, yaw_headroom=0.2)
    assert limits.yaw
    assert not limits.tilt
    assert shares == pytest.approx((0.8, 0.2, 0.0, 1.0))  # yaw cut to 0.2
    assert shares[0] + shares[3] - shares[1] - shares[2] == pytest.approx(4 * 0.5 * 0.8)
    shares, limits = mixed(1.0, 0.0, 1.0, 0.5, average_max=0.5, yaw_headroom=0.2)
    assert limits.tilt
    turn = shares[1] + shares[3] - shares[0] - shares[2]
    assert turn > 0.3
    assert max(shares) - min(shares) == pytest.approx(1.0)


@pytest.mark.parametrize("throttle", [-1.0, 0.0, 0.2, 0.7, 1.5])
@pytest.mark.parametrize("roll", [-1.0, 0.0, 0.6])
@pytest.mark.parametrize("yaw", [-1.0, 0.3])
def test_no_motor_is_asked_for_what_it_cannot_give(
    throttle: float, roll: float, yaw: float
) -> None:
    for pitch in (-1.0, -0.2, 0.9):
        shares = mix(roll, pitch, yaw, throttle, best=0.3)
        assert min(shares) >= -1e-12
        assert max(shares) <= 1 + 1e-12


def test_spooling_up_limits_the_throttle() -> None:
    shares, limits = mixed(0.0, 0.0, 0.0, 0.8, average_max=0.8, yaw_headroom=0.2, top=0.25)
    assert shares == pytest.approx((0.25, 0.25, 0.25, 0.25))
    assert limits.upper


def test_the_motors_spool_up_and_down_in_twice_the_spool_time() -> None:
    spool = Spool(0.5, 0.125)
    up = [spool.update(True) for _ in range(9)]
    assert up == ["ground idle"] * 4 + ["spooling up"] * 4 + ["unlimited"]
    down = [spool.update(False) for _ in range(9)]
    assert down == ["spooling down"] * 4 + ["ground idle"] * 4 + ["shut down"]


# Attitude


def test_a_rotation_splits_into_tilt_and_turn() -> None:
    yaw = heading_quaternion((0.0, 0.0, 1.0), 0.7)
    assert tilt_and_turn(yaw) == pytest.approx((0.0, 0.0, 0.7))
    # A thrust that leans east is a positive turn about y (north).
    lean = heading_quaternion((math.sin(0.2), 0.0, math.cos(0.2)), 0.0)
    assert tilt_and_turn(lean) == pytest.approx((0.0, 0.2, 0.0))
    both = heading_quaternion((math.sin(0.2), 0.0, math.cos(0.2)), 0.7)
    assert tilt_and_turn(both) == pytest.approx((0.0, 0.2, 0.7))
    assert rotated(both, (0.0, 0.0, 1.0)) == pytest.approx((math.sin(0.2), 0.0, math.cos(0.2)))
    assert yaw_of(yaw) == pytest.approx(0.7)
    assert between(both, both) == pytest.approx((0.0, 0.0, 0.0, 1.0))


def test_a_turn_goes_the_short_way_round() -> None:
    a = heading_quaternion((0.0, 0.0, 1.0), math.radians(170))
    b = heading_quaternion((0.0, 0.0, 1.0), math.radians(-170))
    assert tilt_and_turn(between(a, b))[2] == pytest.approx(math.radians(20))


def test_the_attitude_target_turns_no_faster_than_it_may() -> None:
    control = AttitudeControl(P, DT)
    last, fastest, hardest = 0.0, 0.0, 0.0
    speed = 0.0
    for _ in range(240 * 4):
        control.rates((0.0, 0.0, 9.8), math.pi / 2, control.target)
        yaw = yaw_of(control.target)
        hardest = max(hardest, abs((yaw - last) / DT - speed) / DT)
        speed, last = (yaw - last) / DT, yaw
        fastest = max(fastest, speed)
    assert fastest == pytest.approx(math.radians(60), rel=0.01)
    assert hardest <= math.radians(270) * 1.02
    assert last == pytest.approx(math.pi / 2, abs=0.002)


def test_heading_is_given_up_while_the_thrust_points_far_off() -> None:
    control = AttitudeControl(replace(P, atc_rate_ff_enab=False), DT)
    level, thrust = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 9.8)
    small = control.rates(thrust, 0.3, level)
    assert small[2] > 0.5
    leaning = heading_quaternion((0.0, math.sin(1.1), math.cos(1.1)), 0.0)
    far = control.rates(thrust, 0.3, leaning)
    assert far[2] == 0.0
    assert far[0] > 1.0


# Land detector, descent, guidance


def stand(detector: LandDetector, seconds: float, **change: float) -> bool:
    signs = {"tilt_request_rad": 0.0, "tilt_error_rad": 0.0, "climb_mps": 0.0, "height_m": 0.0}
    signs |= {key: value for key, value in change.items() if key in signs}
    for _ in range(round(seconds / DT)):
        detector.update(
            throttle_low=not change.get("throttle"),
            acceleration=(0.0, 0.0, change.get("acceleration", 0.0)),
            **signs,
        )
    return detector.landed


def in_the_air() -> LandDetector:
    detector = LandDetector(DT)
    detector.reset(landed=False)
    return detector


def test_it_has_landed_after_a_second_of_all_signs() -> None:
    detector = in_the_air()
    assert not stand(detector, 0.9)
    assert detector.maybe_landed
    assert stand(detector, 0.15)


@pytest.mark.parametrize(
    "missing",
    [
        {"throttle": 0.3},
        {"tilt_request_rad": math.radians(16)},
        {"tilt_error_rad": math.radians(31)},
        {"climb_mps": -1.1},
        {"height_m": 2.1},
        {"acceleration": 3.0},
    ],
)
def test_one_missing_sign_is_enough_to_fly_on(missing: dict[str, float]) -> None:
    assert not stand(in_the_air(), 3.0, **missing)


def test_a_bounce_starts_the_second_anew() -> None:
    detector = in_the_air()
    stand(detector, 0.8)
    stand(detector, DT, climb_mps=1.5)
    assert not stand(detector, 0.8)


def test_land_comes_down_fast_then_slow() -> None:
    assert descent_rate(30.0, P) == -1.5
    # 1 m above LAND_ALT_LOW: sqrt(2 * 1 * (1 - 0.5)) = 1.
    assert descent_rate(11.0, P) == pytest.approx(-1.0)
    assert descent_rate(9.0, P) == -0.5
    assert descent_rate(30.0, replace(P, land_speed_high=2.0)) == -2.0


def test_over_a_target_it_waits_far_off_and_is_careful_near_the_ground() -> None:
    assert descent_rate_over_target(-0.5, 6.0, 2.6, P) == 0.0
    assert descent_rate_over_target(-0.5, 6.0, 2.4, P) == -0.5
    assert descent_rate_over_target(-0.5, 6.0, 9.0, replace(P, plnd_xy_dist_max=0.0)) == -0.5
    assert descent_rate_over_target(-0.5, 1.0, 0.0, P) == pytest.approx(-0.25)
    assert descent_rate_over_target(-0.5, 1.0, 0.06, P) == pytest.approx(-0.15)
    assert descent_rate_over_target(-0.5, 1.0, 0.3, P) == pytest.approx(-0.10)
    assert descent_rate_over_target(-0.5, 0.3, 0.3, P) == -0.5


def test_a_moving_setpoint_moves_on_until_it_times_out() -> None:
    setpoint = Setpoint(
        time_s=10.0,
        position_m=(1.0, 0.0, 5.0),
        velocity_mps=(2.0, 0.0, 0.0),
        acceleration_mps2=(0.0, 1.0, 0.0),
        speed_mps=10.0,
    )
    assert setpoint.at(10.5, 3.0) == ((2.0, 0.125, 5.0), (2.0, 0.5, 0.0), (0.0, 1.0, 0.0))
    place, velocity, _ = setpoint.at(20.0, 3.0)
    assert place == (7.0, 4.5, 5.0)
    assert velocity == ZERO


# Controller


def state(time_s: float, height: float = 0.2, climb: float = 0.0) -> VehicleState:
    return VehicleState(
        time_s=time_s,
        position_m=(0.0, 0.0, height),
        velocity_mps=(0.0, 0.0, climb),
        attitude=(0.0, 0.0, 0.0, 1.0),
        angular_velocity_radps=(0.0, 0.0, 0.0),
        thrusts_n=(0.0, 0.0, 0.0, 0.0),
    )


def test_it_stands_still_until_told_to_take_off() -> None:
    control = ArduPilotControl(Airframe(control_rate_hz=240))
    control.guide(position=(5.0, 0.0, 3.0))
    control.land()
    for step in range(240):
        assert control.control(state(step * DT)).newtons == (0.0, 0.0, 0.0, 0.0)
    assert control.mode == "stopped"
    assert control.landed


def test_take_off_idles_then_raises_the_throttle_slowly() -> None:
    control = ArduPilotControl(Airframe(control_rate_hz=240))
    control.control(state(0.0))
    control.take_off(5.0)
    totals = [sum(control.control(state(step * DT)).newtons) for step in range(1, 480)]
    assert max(totals[:119]) == 0.0
    # A quarter of TKOFF_SLEW_TIME: a quarter of the full thrust of 82.4 N.
    assert totals[120 + 120] == pytest.approx(20.6, rel=0.02)
    assert all(after >= before for before, after in itertools.pairwise(totals))


def test_a_landing_order_before_lift_off_stops_the_motors() -> None:
    control = ArduPilotControl(Airframe(control_rate_hz=240))
    control.control(state(0.0))
    control.take_off(5.0)
    for step in range(1, 400):
        thrusts = control.control(state(step * DT))
    assert min(thrusts.newtons) > 0
    control.land()
    assert control.control(state(2.0)).newtons == (0.0, 0.0, 0.0, 0.0)
    assert control.mode == "stopped"


def test_an_airframe_without_control_rate_is_refused() -> None:
    with pytest.raises(ValueError, match="control_rate_hz"):
        ArduPilotControl(Airframe())


def test_wrong_options_are_refused() -> None:
    with pytest.raises(ValueError, match="plnd_strict: found 3"):
        ArduPilotParameters(plnd_strict=3)
    with pytest.raises(ValueError, match="plnd_est_type"):
        ArduPilotParameters(plnd_est_type=2)


def test_the_hover_throttle_does_not_depend_on_the_mass() -> None:
    light, heavy = vehicle_of(Airframe(mass_kg=1.0)), vehicle_of(Airframe(mass_kg=4.0))
    assert light.hover_throttle == pytest.approx(heavy.hover_throttle)
    assert tuned(light.hover_throttle).mot_thst_hover == pytest.approx(0.28, abs=0.002)


def test_the_same_states_give_the_same_thrusts() -> None:
    def fly() -> list[tuple[float, ...]]:
        control = ArduPilotControl(Airframe(control_rate_hz=240))
        control.control(state(0.0))
        control.take_off(5.0)
        answers: list[tuple[float, ...]] = []
        for step in range(1, 1200):
            height = 0.2 + max(0.0, step - 600) * 0.005
            if step == 900:
                control.guide(position=(2.0, 1.0, 4.0), yaw=1.0)
            answers.append(control.control(state(step * DT, height, 0.3)).newtons)
        return answers

    assert fly() == fly()
