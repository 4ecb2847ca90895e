"""Genes in the units of files and reports, and back: visibility in m, cover in %, places in m.

In a chromosome weather, the marker's place and NPCs are without unit, so that every step acts alike
along the range: extinction is proportional to 1 / visibility, and the marker's disc is a square.
A value is written with few digits.  :func:`snapped` gives a scenario those values that its file can
write, so that the file flies to the byte as the search flew it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from pytest_garl.scenarios.genes import CLEAR, SUN
from pytest_garl.scenarios.groups.catalogue import GROUPS, PARAMETERS
from pytest_garl.scenarios.groups.parameter import Parameter
from pytest_garl.scenarios.light import (
    NOON_DEG,
    TWILIGHT_DEG,
    position_of,
    position_of_elevation,
    sun_azimuth_deg,
    sun_elevation_deg,
)
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import HEIGHTS_M, OBJECT_TYPES
from pytest_garl.scenarios.placement import (
    MARKER_RADIUS_M,
    marker_genes,
    marker_position_m,
    object_destination_m,
    object_speed_mps,
    object_start_m,
    place_genes,
)
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY, story_values, with_all_values

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
MOST_VISIBILITY_M = 1e6
"""Haze that thin is not seen on any map; a gene that says so becomes 0."""
SIGNIFICANT_DIGITS = 5
_NEAR_ZERO = 1e-9
"""In every unit of a file a value that small has no effect."""
PLACE_DIGITS = 3
"""Millimetres, and millimetres per second."""
ANGLE_DIGITS = 2
LIGHT = ("sun_elevation_deg", "sun_azimuth_deg")
TURN = "light.turn_deg"
HEIGHT = "height_m"
"""Name of the height at which an object flies."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """One weather gene: its name in files, and how its unit follows from the gene.

    ``top`` is the value at gene 1; a visibility is inverse to its gene and infinite at 0.
    """

    name: str
    top: float
    meaning: str
    source: str
    is_visibility: bool = False

    @property
    def limits(self) -> tuple[float, float]:
        """What can be flown, in the unit."""
        return (self.top, MOST_VISIBILITY_M) if self.is_visibility else (0.0, self.top)

    def physical(self, gene: float) -> float:
        """Return the value in the unit, rounded; ``inf`` for the visibility at gene 0."""
        if self.is_visibility:
            return significant(self.top / gene) if gene > 0 else float("inf")
        return significant(gene * self.top)

    def gene(self, value: float) -> float:
        """Return the gene of a value in the unit."""
        return self.top / value if self.is_visibility else value / self.top


_COVER_SOURCE = "the paper's gene, a share"
WEATHER_UNITS: Mapping[str, Weather] = {
    "environment.dust": Weather(
        name="dust_visibility_m",
        top=DUST_VISIBILITY_M,
        is_visibility=True,
        meaning="how far one sees through dust",
        source="ICAO 2009: a dust storm is heavy below 500 m",
    ),
    "environment.fog": Weather(
        name="fog_visibility_m",
        top=FOG_VISIBILITY_M,
        is_visibility=True,
        meaning="how far one sees through fog",
        source="below 10 m in the Great Smog of London, 1952",
    ),
    "environment.rain": Weather(
        name="rain_mmph",
        top=RAIN_MMPH,
        meaning="falling rain",
        source="WMO: violent from 50 mm/h",
    ),
    "environment.snow": Weather(
        name="snow_mmph",
        top=SNOW_MMPH,
        meaning="falling snow, as water",
        source="WMO: heavy from 5 mm/h",
    ),
    "environment.road_wetness": Weather(
        name="wetness_percent", top=100.0, meaning="wetness of the ground", source=_COVER_SOURCE
    ),
    "environment.maple_leaf": Weather(
        name="falling_leaves_per_m3",
        top=LEAVES_PER_M3,
        meaning="falling maple leaves",
        source="engineering estimate of a gust through an autumn maple",
    ),
    "environment.road_leaf": Weather(
        name="leaf_cover_percent",
        top=100.0,
        meaning="share of the ground under leaves",
        source=_COVER_SOURCE,
    ),
    "environment.road_snow": Weather(
        name="snow_cover_percent",
        top=100.0,
        meaning="share of the ground under snow",
        source=_COVER_SOURCE,
    ),
}
"""How files write each of the paper's weather genes; 0 is clear."""
WEATHER_GENES: Mapping[str, str] = {each.name: key for key, each in WEATHER_UNITS.items()}


def significant(value: float, digits: int = SIGNIFICANT_DIGITS) -> float:
    """Return a value rounded to a number of significant digits; one near 0 becomes 0."""
    return float(f"{value:.{digits}g}") if abs(value) > _NEAR_ZERO else 0.0


def snapped(scenario: Scenario, map: Map) -> Scenario:
    """Return the scenario with values that a file can write: millimetres, five digits, 0.01 deg.

    Snapping twice changes nothing more.
    """
    return from_sections(sections_of(scenario, map), scenario, map)


def sections_of(scenario: Scenario, map: Map) -> dict[str, dict[str, float]]:
    """Return the scenario's values as files write them: section, name, value in the name's unit.

    What is nominal is left out, but for the marker's place and the NPCs that are there.
    """
    sections: dict[str, dict[str, float]] = {"weather": {}, "light": {}}
    for key, weather in WEATHER_UNITS.items():
        value = weather.physical(scenario[key])
        if value != 0 and value <= weather.limits[1]:
            sections["weather"][weather.name] = value
    position, turn = scenario[SUN], scenario[TURN]
    if position != 0.5 or turn != 0:
        azimuth = round((sun_azimuth_deg(position) + turn) % 360.0, ANGLE_DIGITS)
        elevation = round(sun_elevation_deg(position), ANGLE_DIGITS)
        sections["light"] = dict(zip(LIGHT, (elevation, azimuth), strict=True))
    sections["marker"] = _inside_disc(_named("", marker_position_m(scenario, map)), map)
    kinds = dict(map.all_objects)
    for name, _ in map.without(scenario.removed_objects).present_objects:
        values = _named("start_", object_start_m(scenario, map, name))
        goal = object_destination_m(scenario, map, name)
        if goal:
            values |= _named("destination_", goal)
        values["speed_mps"] = round(object_speed_mps(scenario, map, name), PLACE_DIGITS)
        if any(key == f"{name}.{HEIGHT}" for key, _ in scenario.genes):
            values[HEIGHT] = round(scenario[f"{name}.{HEIGHT}"], PLACE_DIGITS)
        told = story_values(scenario, name, kinds[name])
        values |= {key: round(value, PLACE_DIGITS) + 0.0 for key, value in told.items()}
        sections[name] = values
    for key, value in scenario.genes:
        if key in PARAMETERS and key != TURN:
            head, _, name = key.partition(".")
            digits = significant(_whole(value, PARAMETERS[key]))
            sections.setdefault(head, {})[name] = digits
    return {name: values for name, values in sections.items() if values}


def from_sections(
    sections: Mapping[str, Mapping[str, float]], like: Scenario, map: Map
) -> Scenario:
    """Return a scenario with the values of a file; map, seed, objects and task as in ``like``."""
    values = dict(CLEAR)
    for name, value in sections.get("weather", {}).items():
        key = WEATHER_GENES[name]
        values[key] = WEATHER_UNITS[key].gene(value)
    light = sections.get("light", {})
    conditions: dict[str, float] = {}
    if light:
        elevation = light.get(LIGHT[0], NOON_DEG)
        morning = sun_azimuth_deg(position_of_elevation(elevation))
        values[SUN], turn = position_of(elevation, light.get(LIGHT[1], morning))
        conditions[TURN] = round(turn, ANGLE_DIGITS)
    marker = sections["marker"]
    values |= marker_genes((marker["x_m"], marker["y_m"]), map)
    kinds = dict(map.all_objects)
    for name, kind in kinds.items():
        if name in like.removed_objects:
            continue
        section = sections[name]
        values |= _place(f"{name}.start", section, map)
        body = "child" if section.get("body") else kind
        values[f"{name}.velocity"] = OBJECT_TYPES[body].share_of(section["speed_mps"])
        if HEIGHT in section:
            values[f"{name}.{HEIGHT}"] = section[HEIGHT]
        if "grade" in section:
            values |= with_all_values(section, name, kind)
        if "destination_x_m" in section:
            values |= _place(f"{name}.destination", section, map)
    for head, section in sections.items():
        named = {f"{head}.{name}": value for name, value in section.items()}
        conditions |= {key: value for key, value in named.items() if key in PARAMETERS}
    bare = Scenario(
        map=like.map,
        seed=like.seed,
        genes=tuple(values.items()),
        removed_objects=like.removed_objects,
        task=like.task,
    )
    return bare.replace(conditions)


def _place(gene: str, section: Mapping[str, float], map: Map) -> dict[str, float]:
    end = gene.partition(".")[2]
    return place_genes(gene, (section[f"{end}_x_m"], section[f"{end}_y_m"]), map)


def _named(prefix: str, place_m: tuple[float, float]) -> dict[str, float]:
    x, y = (round(each, PLACE_DIGITS) + 0.0 for each in place_m)
    return {f"{prefix}x_m": x, f"{prefix}y_m": y}


def _inside_disc(place: dict[str, float], map: Map) -> dict[str, float]:
    """Return a marker's place, moved by a millimetre where rounding took it out of its disc."""
    middle = dict(zip(("x_m", "y_m"), map.gps_position_m, strict=True))
    if math.dist((*place.values(),), (*middle.values(),)) <= MARKER_RADIUS_M:
        return place
    step = 10.0**-PLACE_DIGITS
    return {
        name: round(
            value - math.copysign(min(step, abs(value - middle[name])), value - middle[name]),
            PLACE_DIGITS,
        )
        for name, value in place.items()
    }


def ranges_of(head: str, map: Map) -> dict[str, tuple[float, float]]:
    """Return what can be flown of each value in a section of a file: (lowest, highest)."""
    if head == "weather":
        return {each.name: each.limits for each in WEATHER_UNITS.values()}
    if head == "light":
        return {LIGHT[0]: (TWILIGHT_DEG, NOON_DEG), LIGHT[1]: (0.0, 360.0)}
    if head == "marker":
        (x, y), reach = map.gps_position_m, MARKER_RADIUS_M
        return {"x_m": (x - reach, x + reach), "y_m": (y - reach, y + reach)}
    kinds = dict(map.all_objects)
    if head in kinds:
        x_min, x_max, y_min, y_max = map.bounds_m
        places: dict[str, tuple[float, float]] = {}
        for end in ("start", "destination"):
            places |= {f"{end}_x_m": (x_min, x_max), f"{end}_y_m": (y_min, y_max)}
        kind = OBJECT_TYPES[kinds[head]]
        heights = {HEIGHT: HEIGHTS_M} if kind.flies else {}
        told = {
            each.name: (each.low, each.high) for each in STORY.values() if kind.name in each.types
        }
        top_mps = max(kind.top_speed_mps, OBJECT_TYPES["child"].top_speed_mps * ("body" in told))
        return places | {"speed_mps": (0.0, top_mps)} | heights | told
    return {each.name: (each.low, each.high) for each in GROUPS[head].parameters}


_WORDS = {
    "dust_visibility_m": "dust, visibility {:g} m",
    "fog_visibility_m": "fog, visibility {:g} m",
    "rain_mmph": "falling rain, {:g} mm/h",
    "snow_mmph": "falling snow, {:g} mm/h",
    "wetness_percent": "{:g} % as wet as it gets",
    "falling_leaves_per_m3": "falling leaves, {:g} per cubic metre",
    "leaf_cover_percent": "{:g} % of the ground under leaves",
    "snow_cover_percent": "{:g} % of the ground under snow",
}


def _whole(value: float, parameter: Parameter) -> float:
    if parameter.choices:
        return float(math.ceil(value))
    return float(round(value)) if parameter.whole else value


def conditions_in_words(scenario: Scenario, map: Map) -> list[tuple[str, str]]:
    """Return (name, words) of each condition that is not nominal: weather, light, groups."""
    sections = sections_of(scenario, map)
    found = [
        (name, _WORDS[name].format(significant(value, 3)))
        for name, value in sections.get("weather", {}).items()
    ]
    light = sections.get("light")
    if light:
        elevation, azimuth = (light[name] for name in LIGHT)
        words = f"sun at an elevation of {elevation:.0f} degrees, azimuth {azimuth:.0f} degrees"
        found.append(("light", words))
    for head, group in GROUPS.items():
        for parameter in group.parameters:
            key = f"{head}.{parameter.name}"
            if key != TURN and scenario[key] != parameter.nominal:
                found.append((key, _in_words(scenario[key], parameter)))
    return found


def _in_words(value: float, parameter: Parameter) -> str:
    if parameter.choices:
        return parameter.text_of(value)
    return f"{f'{value:g} {unit_of(parameter.name)}'.rstrip()}: {parameter.meaning}"


def unit_of(name: str) -> str:
    """Return the unit that a name ends with, for a reader; empty without one."""
    return next((unit for ending, unit in UNITS.items() if name.endswith(ending)), "")


UNITS = {
    "_per_m3": "per cubic metre",
    "_mps": "m/s",
    "_mmph": "mm/h",
    "_degps": "degrees/s",
    "_deg": "degrees",
    "_percent": "%",
    "_ms": "ms",
    "_hz": "Hz",
    "_mm": "mm",
    "_m": "m",
    "_s": "s",
}
