"""Physical meaning of each environment gene, with sources; fixed before any flight is judged."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.groups import (
    DUST_VISIBILITY_M,
    FOG_VISIBILITY_M,
    LEAVES_PER_M3,
    RAIN_MMPH,
    SNOW_MMPH,
)
from pytest_garl.scenarios.light import sun_elevation_deg
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import TURN

KOSCHMIEDER = 3.912
"""Visibility = 3.912 / extinction: Koschmieder's law (1924) at a contrast threshold of 2 %."""
WET_ALBEDO_LOSS = 0.45
"""Gene 1: engineering estimate; soaked rough ground is markedly darker (theory: Lekner and
Dorf 1988)."""
_LUX = (
    (-6.0, 3.4),
    (0.0, 400.0),
    (5.0, 4000.0),
    (10.0, 10000.0),
    (30.0, 50000.0),
    (60.0, 100000.0),
)
"""Horizontal illuminance of a clear sky by elevation in degrees: 3.4 lux is the end of civil
twilight, 400 lux sunrise (AMS Glossary), 100,000 lux a high sun, the rest rounded engineering
estimates; between them interpolated in its logarithm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """The physical meaning of a scenario's environment genes.

    ``extinction_per_m`` is the sum over fog, dust, rain and snow; ``airlight`` the RGB
    colour (0..255, at full light) that replaces what the air hides.  ``sun`` is the unit
    vector towards the sun.
    """

    extinction_per_m: float
    airlight: tuple[float, float, float]
    rain_mmph: float
    snow_mmph: float
    leaves_per_m3: float
    wetness: float
    leaf_cover: float
    snow_cover: float
    sun: tuple[float, float, float]
    illuminance_lux: float
    direct_share: float


def conditions_of(scenario: Scenario) -> Conditions:
    """Return what the environment genes of a scenario mean."""
    gene = {key.partition(".")[2]: scenario[key] for key in ENVIRONMENT}
    fog = gene["fog"] * KOSCHMIEDER / FOG_VISIBILITY_M
    dust = gene["dust"] * KOSCHMIEDER / DUST_VISIBILITY_M
    rain, snow = gene["rain"] * RAIN_MMPH, gene["snow"] * SNOW_MMPH
    extinction = fog + dust + rain_extinction_per_m(rain) + snow_extinction_per_m(snow)
    grey, brown = (205.0, 210.0, 214.0), (196.0, 164.0, 120.0)
    share = dust / extinction if extinction > 0 else 0.0
    elevation = sun_elevation_deg(gene["sun_position"])
    azimuth = math.pi * gene["sun_position"] + math.radians(scenario[TURN])
    height = math.radians(elevation)
    return Conditions(
        extinction_per_m=extinction,
        airlight=_mix(grey, brown, share),
        rain_mmph=rain,
        snow_mmph=snow,
        leaves_per_m3=gene["maple_leaf"] * LEAVES_PER_M3,
        wetness=gene["road_wetness"],
        leaf_cover=gene["road_leaf"],
        snow_cover=gene["road_snow"],
        # East at 0, south at noon, west at 1, as north of the tropics.
        sun=(
            math.cos(azimuth) * math.cos(height),
            -math.sin(azimuth) * math.cos(height),
            math.sin(height),
        ),
        illuminance_lux=_illuminance(elevation),
        # The clearer and higher the sun, the more light comes from one direction.
        direct_share=0.75 * _ramp(elevation, 0.0, 20.0) * math.exp(-extinction * 10.0),
    )


def rain_extinction_per_m(rate_mmph: float) -> float:
    """Optical extinction of rain: 0.312 R^0.67 per km (as in rain rendering: Weber et al. 2015)."""
    return 0.312e-3 * float(rate_mmph**0.67)


def snow_extinction_per_m(rate_mmph: float) -> float:
    """Optical extinction of snow: visibility about 1 km at 1 mm/h, inverse to the rate.

    A simplification: Rasmussen et al. (1999) find a scatter of 3 to 10 times.
    """
    return KOSCHMIEDER / 1000.0 * rate_mmph


def rain_speed_mps(diameter_mm: float) -> float:
    """Terminal speed of a drop, fit of Atlas et al. (1973) to Gunn and Kinzer (1949)."""
    return max(0.5, 9.65 - 10.3 * math.exp(-0.6 * diameter_mm))


def _illuminance(elevation_deg: float) -> float:
    for (low, dim), (high, bright) in itertools.pairwise(_LUX):
        if elevation_deg <= high:
            share = (elevation_deg - low) / (high - low)
            return float(math.exp(math.log(dim) + share * (math.log(bright) - math.log(dim))))
    return _LUX[-1][1]


def _ramp(value: float, low: float, high: float) -> float:
    return min(1.0, max(0.0, (value - low) / (high - low)))


def _mix(
    a: tuple[float, float, float], b: tuple[float, float, float], share: float
) -> tuple[float, float, float]:
    red, green, blue = (p + share * (q - p) for p, q in zip(a, b, strict=True))
    return red, green, blue
