from __future__ import annotations

import pytest

from pytest_garl.vehicle.mixer import Shares, mixed
from pytest_garl.vehicle.spool import Spool


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
def test_no_motor_gets_more_than_its_range(throttle: float, roll: float, yaw: float) -> None:
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
