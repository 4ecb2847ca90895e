from __future__ import annotations

import pytest

from pytest_garl.npcs.steering import arrived, towards
from pytest_garl.simulation.npc_policy import STAY
from tests.support.situations import being, situation


def test_an_npc_goes_straight_at_full_speed() -> None:
    move = towards((3.0, 4.0), situation(being((0.0, 0.0))))
    assert (move.x, move.y) == pytest.approx((0.6, 0.8))


def test_an_npc_at_its_goal_stays() -> None:
    assert towards((3.0, 4.0), situation(being((3.0, 4.0)))) == STAY


@pytest.mark.parametrize(("distance_m", "expected"), [(0.9, True), (1.1, False)])
def test_an_npc_has_arrived_within_one_stride(distance_m: float, expected: bool) -> None:
    here = situation(being((0.0, 0.0), speed_mps=2.0))
    assert arrived((distance_m, 0.0), here) is expected


def test_a_slow_npc_has_arrived_within_half_a_metre() -> None:
    here = situation(being((0.0, 0.0), speed_mps=0.1))
    assert arrived((0.4, 0.0), here)
    assert not arrived((0.6, 0.0), here)
