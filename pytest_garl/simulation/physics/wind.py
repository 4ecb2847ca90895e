"""Wind over the pad: a mean that grows with height, and Dryden turbulence along the flight."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pytest_garl.scenarios.maps.map import Texture
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.physics.vehicle import Vector
from pytest_garl.simulation.randomness import generator

MEASURED_AT_M = 6.0
"""Height of the mean wind: MIL-F-8785C has 20 ft."""
ROUGHNESS_M: dict[Texture, float] = {
    "concrete": 0.005,
    "asphalt": 0.005,
    "grass": 0.03,
    "sand": 0.005,
    "soil": 0.005,
}
"""Roughness length: 0.03 m is the class "open" (grass, few isolated obstacles) and 0.005 m the
class "smooth" (no vegetation, no obstacles) of the Davenport classification in WMO-No. 8."""
SCALES_HELD_BELOW_M = 3.0
"""MIL-F-8785C states its low-altitude scales from 10 ft up."""
LEAST_AIRSPEED_MPS = 1.0
"""Gusts are frozen and carried past the UAV.  In still air they would never change, so they pass at
this speed at least."""
TICKS_PER_GUST = 4
"""Gusts change 60 times a second: their shortest time constant is 0.3 s (3 m at 10 m/s)."""
GUST_STEP_S = TICKS_PER_GUST / 240
CALM: Vector = (0.0, 0.0, 0.0)
_M_PER_FT = 0.3048
_LATERAL = (math.sqrt(3) / math.sqrt(2), (1 - math.sqrt(3)) / math.sqrt(2))


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanWind:
    """The mean wind over one ground: ``x_mps`` and ``y_mps`` at 6 m, less below, more above.

    The profile is logarithmic: U(z) = U(6 m) ln(z / z0) / ln(6 m / z0), with z0 = ``roughness_m``.
    """

    x_mps: float
    y_mps: float
    roughness_m: float

    def at(self, height_m: float) -> Vector:
        """Return the velocity of the air at a height above the ground."""
        if height_m <= self.roughness_m or not (self.x_mps or self.y_mps):
            return CALM
        log_at_6_m = math.log(MEASURED_AT_M / self.roughness_m)
        share = math.log(height_m / self.roughness_m) / log_at_6_m
        return self.x_mps * share, self.y_mps * share, 0.0


def mean_wind(scenario: Scenario, ground: Texture) -> MeanWind:
    """Return the mean wind of a scenario over a ground."""
    speed, towards = scenario["wind.mean_mps"], math.radians(scenario["wind.towards_deg"])
    return MeanWind(
        x_mps=speed * math.cos(towards),
        y_mps=speed * math.sin(towards),
        roughness_m=ROUGHNESS_M[ground],
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Turbulence:
    """Standard deviations (m/s) and scales (m) of gusts along, across and above the mean wind."""

    along_mps: float
    up_mps: float
    along_length_m: float
    up_length_m: float


def low_altitude_turbulence(mean_mps: float, height_m: float) -> Turbulence:
    """Return the turbulence of MIL-F-8785C below 1,000 ft for a mean wind at 6 m.

    With the height h in feet: sigma_w = 0.1 W20, L_w = h,
    sigma_u = sigma_v = sigma_w / (0.177 + 0.000823 h)^0.4 and
    L_u = L_v = h / (0.177 + 0.000823 h)^1.2.
    """
    height_ft = max(SCALES_HELD_BELOW_M, height_m) / _M_PER_FT
    term = 0.177 + 0.000823 * height_ft
    up_mps = 0.1 * mean_mps
    return Turbulence(
        along_mps=up_mps / term**0.4,
        up_mps=up_mps,
        along_length_m=height_ft / term**1.2 * _M_PER_FT,
        up_length_m=height_ft * _M_PER_FT,
    )


class _AlongFilter:
    """Dryden's longitudinal filter 1 / (1 + T s) on white noise, scaled to a variance of 1."""

    def __init__(self, noise: Callable[[], float]) -> None:
        self._noise = noise
        self._state = noise()

    def step(self, over_t: float) -> float:
        """Advance by a time in units of T, exactly, and return the gust."""
        decay = math.exp(-over_t)
        self._state = decay * self._state + math.sqrt(1 - decay * decay) * self._noise()
        return self._state


class _AcrossFilter:
    """Dryden's lateral and vertical filter (1 + sqrt(3) T s) / (1 + T s)^2, variance 1.

    It is sqrt(3) / (1 + T s) + (1 - sqrt(3)) / (1 + T s)^2: the weighted sum of a first state and
    of a second one that follows the first.  Their stationary covariance is [[1, 1/2], [1/2, 1/2]].
    """

    def __init__(self, noise: Callable[[], float]) -> None:
        self._noise = noise
        self._first = noise()
        self._second = 0.5 * self._first + 0.5 * noise()

    def step(self, over_t: float) -> float:
        """Advance by a time in units of T, exactly, and return the gust."""
        decay = math.exp(-over_t)
        square = decay * decay
        # The covariance that the noise must add, so that the stationary one stays; then its root.
        first = 1 - square
        both = 0.5 - square * (over_t + 0.5)
        second = 0.5 - square * (over_t * over_t + over_t + 0.5)
        root = math.sqrt(first)
        a, b = self._noise(), self._noise()
        rest = math.sqrt(max(0.0, second - both * both / first))
        self._second = decay * (self._second + over_t * self._first) + both / root * a + rest * b
        self._first = decay * self._first + root * a
        return _LATERAL[0] * self._first + _LATERAL[1] * self._second


class Wind:
    """The air of one flight; ask for it once per tick of the physics.

    Gusts are frozen in the air (Taylor's hypothesis), so the UAV meets them at its speed through
    the air: T = L / V.  Their axes are along the mean wind, across it, and up.
    """

    def __init__(self, scenario: Scenario, ground: Texture) -> None:
        self.mean = mean_wind(scenario, ground)
        self._mean_mps = scenario["wind.mean_mps"]
        self._intensity = scenario["wind.turbulence"]
        towards = math.radians(scenario["wind.towards_deg"])
        self._cos, self._sin = math.cos(towards), math.sin(towards)
        noise = generator(scenario.seed, "wind").standard_normal
        self._along = _AlongFilter(noise)
        self._across, self._up = _AcrossFilter(noise), _AcrossFilter(noise)
        self._gust = CALM

    def velocity_mps(self, tick: int, position_m: Vector, velocity_mps: Vector) -> Vector:
        """Return the velocity of the air at the UAV."""
        if not self._mean_mps:
            return CALM
        mean = self.mean.at(position_m[2])
        if not self._intensity:
            return mean
        if tick % TICKS_PER_GUST == 0:
            self._gust = self._next_gust(position_m[2], math.dist(velocity_mps, mean))
        (mx, my, mz), (gx, gy, gz) = mean, self._gust
        return mx + gx, my + gy, mz + gz

    def _next_gust(self, height_m: float, airspeed_mps: float) -> Vector:
        turbulence = low_altitude_turbulence(self._mean_mps, height_m)
        passed_m = max(LEAST_AIRSPEED_MPS, airspeed_mps) * GUST_STEP_S
        level = self._intensity * turbulence.along_mps
        along = level * self._along.step(passed_m / turbulence.along_length_m)
        across = level * self._across.step(passed_m / turbulence.along_length_m)
        up = self._intensity * turbulence.up_mps * self._up.step(passed_m / turbulence.up_length_m)
        x, y = along * self._cos - across * self._sin, along * self._sin + across * self._cos
        return x, y, up
