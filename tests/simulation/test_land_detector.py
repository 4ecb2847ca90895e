"""When the motors stop on the ground: (on the ground, thrust, climb) for each step."""

from __future__ import annotations

import pytest

from pytest_garl import Airframe
from pytest_garl.flight.thresholds import GRAVITY_MPS2
from pytest_garl.simulation.land_detector import LandDetector
from pytest_garl.simulation.physics.vehicle import REFERENCE_MASS_KG, vehicle_model

WEIGHT_N = REFERENCE_MASS_KG * GRAVITY_MPS2


def stop_s(on_ground: bool, thrust_n: float, climb_mps: float) -> float | None:
    detector = LandDetector(vehicle_model(Airframe()))
    for tick in range(1, 720):
        if detector.lands(tick / 240, on_ground, thrust_n, climb_mps):
            return tick / 240
    return None


def test_low_thrust_on_the_ground_stops_the_motors_after_a_second() -> None:
    assert stop_s(True, 0.29 * WEIGHT_N, 0.1) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("on_ground", "share", "climb_mps"),
    [(False, 0.1, 0.0), (True, 0.31, 0.0), (True, 0.29, -0.21)],
)
def test_other_states_do_not_stop_them(on_ground: bool, share: float, climb_mps: float) -> None:
    assert stop_s(on_ground, share * WEIGHT_N, climb_mps) is None


def test_switched_off_motors_stop_whatever_the_vertical_speed() -> None:
    assert stop_s(True, 4.0, 0.5) == pytest.approx(1.0, abs=0.01)
    assert stop_s(True, 4.2, 0.5) is None


def test_interruption_begins_the_second_anew() -> None:
    detector = LandDetector(vehicle_model(Airframe()))
    assert not detector.lands(0.0, True, 0.0, 0.0)
    assert not detector.lands(0.9, True, WEIGHT_N, 0.0)
    assert not detector.lands(1.0, True, 0.0, 0.0)
    assert not detector.lands(1.9, True, 0.0, 0.0)
    assert detector.lands(2.0, True, 0.0, 0.0)
