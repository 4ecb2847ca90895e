"""Genes in the units of files and reports, and back: visibility in m, cover in %, places in m.

In a chromosome weather, the marker's place and NPCs are without unit, so that every step acts alike
along the range: extinction is proportional to 1 / visibility, and the marker's disc is a square.
A value is written with few digits.  :func:`snapped` gives a scenario those values that its file can
write, so that the file flies to the byte as the search flew it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pytest_garl.scenarios.genes import CLEAR, SUN
from pytest_garl.scenarios.groups import GROUPS, QUANTITIES, WEATHER
from pytest_garl.scenarios.light import (
    NOON_DEG,
    TWILIGHT_DEG,
    position_of,
    position_of_elevation,
    sun_azimuth_deg,
    sun_elevation_deg,
)
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M, OBJECT_TYPES
from pytest_garl.scenarios.placed import MARKER_RADIUS_M, Placed, marker_genes, place_genes
from pytest_garl.scenarios.quantities import Quantity, significant
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY, story_values, with_all_values

MOST_VISIBILITY_M = 1e6
"""Haze that thin is not seen on any map; a gene that says so becomes 0."""
PLACE_DIGITS = 3
"""Millimetres, and millimetres per second."""
ANGLE_DIGITS = 2
LIGHT = ("sun_elevation_deg", "sun_azimuth_deg")
TURN = "light.turn_deg"
HEIGHT = "height_m"
"""Name of the height at which an object flies."""


GENE_OF_WEATHER: Mapping[str, str] = {each.name: gene for gene, each in WEATHER.items()}
"""The paper's genes by the names that files give the weather."""


def snapped(scenario: Scenario, map: Map) -> Scenario:
    """Return the scenario with values that a file can write: millimetres, five digits, 0.01 deg.

    Snapping twice changes nothing more.
    """
    return from_sections(sections_of(scenario, map), scenario, map)


def sections_of(scenario: Scenario, map: Map) -> dict[str, dict[str, float]]:
    """Return the scenario's values as files write them: section, name, value in the name's unit.

    Nominal values are left out, except the marker's place and the NPCs that are there.
    """
    sections: dict[str, dict[str, float]] = {"weather": {}, "light": {}}
    for gene, weather in WEATHER.items():
        value = weather.at(scenario[gene])
        if value != 0 and value <= MOST_VISIBILITY_M:
            sections["weather"][weather.name] = value
    position, turn = scenario[SUN], scenario[TURN]
    if position != 0.5 or turn != 0:
        azimuth = round((sun_azimuth_deg(position) + turn) % 360.0, ANGLE_DIGITS)
        elevation = round(sun_elevation_deg(position), ANGLE_DIGITS)
        sections["light"] = dict(zip(LIGHT, (elevation, azimuth), strict=True))
    placed = Placed(scenario, map)
    sections["marker"] = _inside_disc(_named("", placed.marker_m), map)
    kinds = dict(map.all_objects)
    for name, _ in placed.map.present_objects:
        npc = placed.npc(name)
        values = _named("start_", npc.start_m)
        if npc.destination_m:
            values |= _named("destination_", npc.destination_m)
        values["speed_mps"] = round(npc.speed_mps, PLACE_DIGITS)
        if any(key == f"{name}.{HEIGHT}" for key, _ in scenario.genes):
            values[HEIGHT] = round(scenario[f"{name}.{HEIGHT}"], PLACE_DIGITS)
        told = story_values(scenario, name, kinds[name])
        values |= {key: round(value, PLACE_DIGITS) + 0.0 for key, value in told.items()}
        sections[name] = values
    decided = scenario.decided_events
    for key, value in scenario.genes:
        if key in QUANTITIES and key != TURN:
            head, _, name = key.partition(".")
            if name == "from_s" and head in decided:
                # The director decides, so that no delay counts.
                continue
            digits = significant(QUANTITIES[key].flown(value))
            sections.setdefault(head, {})[name] = digits
    return {name: values for name, values in sections.items() if values}


def from_sections(
    sections: Mapping[str, Mapping[str, float]], like: Scenario, map: Map
) -> Scenario:
    """Return a scenario with the values of a file; map, seed, objects and task as in ``like``."""
    values = dict(CLEAR)
    for name, value in sections.get("weather", {}).items():
        gene = GENE_OF_WEATHER[name]
        values[gene] = WEATHER[gene].share_of(value)
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
        conditions |= {key: value for key, value in named.items() if key in QUANTITIES}
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
        return {
            each.name: (each.low, min(each.high, MOST_VISIBILITY_M)) for each in WEATHER.values()
        }
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
        heights = {HEIGHT: BIRD_HEIGHTS_M} if kind.flies else {}
        told = {
            each.name: (each.quantity.low, each.quantity.high)
            for each in STORY.values()
            if kind.name in each.types
        }
        top_mps = max(kind.top_speed_mps, OBJECT_TYPES["child"].top_speed_mps * ("body" in told))
        return places | {"speed_mps": (0.0, top_mps)} | heights | told
    return {each.name: (each.low, each.high) for each in GROUPS[head].quantities}


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
    found += [
        (key, _in_words(scenario, each))
        for key, each in QUANTITIES.items()
        if key != TURN and scenario[key] != each.nominal
    ]
    return found


def _in_words(scenario: Scenario, quantity: Quantity) -> str:
    value = scenario[quantity.key]
    if quantity.choices:
        return quantity.text_of(value)
    return f"{f'{value:g} {quantity.unit}'.rstrip()}: {quantity.meaning}"
