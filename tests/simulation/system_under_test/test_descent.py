from __future__ import annotations

import pytest

from pytest_garl.landing_system import Land, VelocitySetpoint
from pytest_garl.simulation.system_under_test.descent import centring_velocity, descend

MARKER_M = (3.0, 1.0)


@pytest.mark.parametrize(("height_m", "climb_mps"), [(9.0, -0.8), (1.0, -0.4)])
def test_a_pilot_descends_at_half_the_speed_near_the_ground(
    height_m: float, climb_mps: float
) -> None:
    command = descend(MARKER_M, (*MARKER_M, height_m), 0.8)
    assert isinstance(command, VelocitySetpoint)
    assert command.velocity_mps == pytest.approx((0.0, 0.0, climb_mps))


def test_a_pilot_beside_the_marker_moves_to_it_and_keeps_its_height() -> None:
    command = descend(MARKER_M, (2.5, 1.0, 5.0), 0.8)
    assert isinstance(command, VelocitySetpoint)
    assert command.velocity_mps == pytest.approx((0.6, 0.0, 0.0))


def test_a_pilot_lands_just_above_the_ground() -> None:
    assert isinstance(descend(MARKER_M, (*MARKER_M, 0.3), 0.8), Land)


def test_the_velocity_towards_the_marker_is_limited() -> None:
    assert centring_velocity(MARKER_M, (-9.0, 30.0)) == (1.0, -1.0)
