from __future__ import annotations

import itertools

import pytest

from pytest_garl import Airframe, VehicleState
from pytest_garl.vehicle import (
    ArduPilotControl,
    ArduPilotParameters,
    tuned,
    vehicle_of,
)

DT = 1 / 240


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
