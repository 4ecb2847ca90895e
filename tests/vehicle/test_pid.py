from __future__ import annotations

import math

import pytest

from pytest_garl.vehicle import (
    ArduPilotParameters,
)
from pytest_garl.vehicle.filters import smoothing
from pytest_garl.vehicle.pid import Pid
from pytest_garl.vehicle.position import HorizontalControl

DT = 1 / 240
P = ArduPilotParameters()


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
