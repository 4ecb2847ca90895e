"""Physical meaning of each environment gene, with sources; fixed before any flight is judged."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.scenario import Scenario

KOSCHMIEDER = 3.912
"""Visibility = 3.912 / extinction: Koschmieder's law (1924) at a contrast threshold of 2 %."""
FOG_VISIBILITY_M = 10.0
"""Gene 1: below 10 m were reported in the Great Smog of London, 1952."""
DUST_VISIBILITY_M = 20.0
"""Gene 1: engineering estimate, far below the 500 m at which a dust storm counts as heavy
(ICAO 2009)."""
RAIN_MMPH = 100.0
"""Gene 1: twice the 50 mm/h from which the WMO calls rain violent."""
SNOW_MMPH = 10.0
"""Gene 1: water equivalent; twice the 5 mm/h from which the WMO calls snow heavy."""
LEAVES_PER_M3 = 2.0
"""Gene 1: engineering estimate of a gust through an autumn maple."""
WET_ALBEDO_LOSS = 0.45
"""Gene 1: engineering estimate; soaked rough ground is markedly darker (theory: Lekner and
Dorf 1988)."""
TWILIGHT_DEG = -6.0
"""Elevation at gene 0 and 1: the end of civil twilight (AMS Glossary); darker than that is
night."""
NOON_DEG = 60.0
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
    azimuth = math.pi * gene["sun_position"]
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


def in_units(key: str, value: float) -> str:
    """Return the meaning of a value of an environment gene, in physical units."""
    name = key.partition(".")[2]
    if name == "sun_position":
        return f"sun at an elevation of {sun_elevation_deg(value):.0f} degrees"
    if name in ("fog", "dust"):
        nearest_m = FOG_VISIBILITY_M if name == "fog" else DUST_VISIBILITY_M
        return f"{name}, visibility {nearest_m / value:.0f} m"
    if name in ("rain", "snow"):
        most = RAIN_MMPH if name == "rain" else SNOW_MMPH
        return f"falling {name}, {most * value:.1f} mm/h"
    if name == "maple_leaf":
        return f"falling leaves, {LEAVES_PER_M3 * value:.2f} per cubic metre"
    what = {
        "road_wetness": "as wet as it gets",
        "road_leaf": "of the ground under leaves",
        "road_snow": "of the ground under snow",
    }
    return f"{100 * value:.0f} % {what[name]}"


def sun_elevation_deg(position: float) -> float:
    """Return the sun's elevation: dawn at 0, noon at 0.5, dusk at 1."""
    return TWILIGHT_DEG + (NOON_DEG - TWILIGHT_DEG) * math.sin(math.pi * position)


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
