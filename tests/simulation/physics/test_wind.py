"""Wind: the profile over the ground, Dryden's statistics, and calm air without it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl import Command, Observation, PositionSetpoint
from pytest_garl.scenarios.maps.map import Texture
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.physics.wind import (
    CALM,
    GUST_STEP_S,
    TICKS_PER_GUST,
    Wind,
    low_altitude_turbulence,
    mean_wind,
)
from tests.support.flights import EMPTY, STAND, Hovers, Scripted, nominal

STILL = (0.0, 0.0, 0.0)
MEAN_MPS = 5.0


def gusts(
    height_m: float, count: int, turbulence: float = 1.0, towards_deg: float = 0.0
) -> NDArray[np.float64]:
    """Gusts along, across and up (count, 3) that a UAV meets which hovers at a height."""
    genes = {"wind__turbulence": turbulence, "wind__towards_deg": towards_deg}
    scenario = nominal(wind__mean_mps=MEAN_MPS, **genes)
    wind = Wind(scenario, "grass")
    mean = np.array(wind.mean.at(height_m))
    place = (0.0, 0.0, height_m)
    rows = [wind.velocity_mps(i * TICKS_PER_GUST, place, STILL) for i in range(count)]
    found: NDArray[np.float64] = np.array(rows) - mean
    return found


def test_mean_wind_is_given_at_six_metres() -> None:
    wind = mean_wind(nominal(wind__mean_mps=4.0, wind__towards_deg=30.0), "grass")
    assert wind.at(6.0) == pytest.approx((4 * math.cos(math.pi / 6), 2.0, 0.0))


@pytest.mark.parametrize(("ground", "roughness_m"), [("grass", 0.03), ("concrete", 0.005)])
def test_wind_grows_with_the_logarithm_of_height(ground: Texture, roughness_m: float) -> None:
    wind = mean_wind(nominal(wind__mean_mps=4.0), ground)
    for height_m in (0.2, 1.0, 10.0):
        share = math.log(height_m / roughness_m) / math.log(6.0 / roughness_m)
        assert wind.at(height_m)[0] == pytest.approx(4 * share)
    assert wind.at(roughness_m) == wind.at(-1.0) == CALM


def test_turbulence_is_that_of_the_standard() -> None:
    # At 20 ft: 0.177 + 0.000823 * 20 = 0.19346.
    found = low_altitude_turbulence(10.0, 20 * 0.3048)
    assert found.up_mps == pytest.approx(1.0)
    assert found.along_mps == pytest.approx(1 / 0.19346**0.4)
    assert found.up_length_m == pytest.approx(6.096)
    assert found.along_length_m == pytest.approx(6.096 / 0.19346**1.2)


def test_scales_are_held_below_three_metres() -> None:
    assert low_altitude_turbulence(5.0, 0.2) == low_altitude_turbulence(5.0, 3.0)
    assert low_altitude_turbulence(5.0, 3.5) != low_altitude_turbulence(5.0, 3.0)


def test_gusts_have_the_standard_deviation_of_the_standard() -> None:
    turbulence = low_altitude_turbulence(MEAN_MPS, 6.0)
    found = gusts(6.0, 60_000).std(axis=0)
    # 1,000 s: some 100 correlation times along the wind, 800 of the vertical gusts.
    assert found[:2] == pytest.approx([turbulence.along_mps] * 2, rel=0.2)
    assert found[2] == pytest.approx(turbulence.up_mps, rel=0.1)


def test_vertical_gusts_have_drydens_autocorrelation() -> None:
    # The Fourier pair of (1 + 3 (T w)^2) / (1 + (T w)^2)^2 is (1 - t / 2T) exp(-t / T).
    up = gusts(6.0, 60_000)[:, 2]
    time_constant_s = low_altitude_turbulence(MEAN_MPS, 6.0).up_length_m / MEAN_MPS
    for over_t in (0.5, 1.0, 2.0):
        lag = round(over_t * time_constant_s / GUST_STEP_S)
        found = float(np.mean(up[:-lag] * up[lag:]) / np.mean(up * up))
        assert found == pytest.approx((1 - over_t / 2) * math.exp(-over_t), abs=0.08)


def test_gusts_turn_with_the_wind() -> None:
    along = gusts(6.0, 200)
    turned = gusts(6.0, 200, towards_deg=90.0)
    assert turned[:, 0] == pytest.approx(-along[:, 1])
    assert turned[:, 1] == pytest.approx(along[:, 0])


def test_intensity_scales_the_gusts() -> None:
    half = gusts(6.0, 50, turbulence=0.5)
    assert half == pytest.approx(gusts(6.0, 50) / 2)


def test_air_without_a_mean_wind_stands_still() -> None:
    wind = Wind(nominal(wind__turbulence=1.5, wind__towards_deg=90.0), "grass")
    assert {wind.velocity_mps(tick, (0.0, 0.0, 6.0), STILL) for tick in range(50)} == {CALM}


def test_gusts_move_a_hovering_uav() -> None:
    def moved_m(turbulence: float) -> float:
        scenario = nominal(wind__mean_mps=6.0, wind__turbulence=turbulence)
        flight = fly(scenario, Hovers, STAND, map=EMPTY, time_limit_s=30.0)
        late = flight.uav.position_m[flight.uav.time_s > 15.0]
        return float(np.ptp(late, axis=0).max())

    steady, gusty = moved_m(0.0), moved_m(1.0)
    assert steady < 0.02
    assert 0.1 < gusty < 2.0


class HoversHigh(Scripted):
    def step(self, observation: Observation) -> Command:
        return self.hover(10.0)


class HoversLow(Scripted):
    def step(self, observation: Observation) -> Command:
        return PositionSetpoint(position_m=(*self.home[:2], 1.0))


def test_uav_leans_less_near_the_ground() -> None:
    def lean_deg(system: type) -> float:
        flight = fly(nominal(wind__mean_mps=8.0), system, STAND, map=EMPTY, time_limit_s=15.0)
        x, y = flight.uav.attitude[-1, :2]
        return math.degrees(math.acos(1 - 2 * (x * x + y * y)))

    high, low = lean_deg(HoversHigh), lean_deg(HoversLow)
    # tan(lean) = drag / weight, with the wind of 8.77 and 5.29 m/s at 10 and 1 m.
    assert high == pytest.approx(10.9, abs=0.5)
    assert low == pytest.approx(5.2, abs=0.5)
