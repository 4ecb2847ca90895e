"""The operational domain: the range of each condition in which a landing system is to land.

Industry's term is *operational design domain* (ISO 34503).  A violation inside it is a bug.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from pytest_garl.scenarios.genes import WeatherRange, genome_for
from pytest_garl.scenarios.groups import GROUPS, QUANTITIES, WEATHER
from pytest_garl.scenarios.light import NOON_DEG, TWILIGHT_DEG
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, STORY, story_of
from pytest_garl.scenarios.units import sections_of

ABSENT = "absent"
"""The behaviour of NPCs in a domain without them."""
ELEVATION = "light.sun_elevation_deg"
BIRD_HEIGHT = "npcs.bird_height_m"
_TOLERANCE = 1e-4
"""Files keep five digits."""


_LIGHT = Quantity(
    key=ELEVATION,
    low=TWILIGHT_DEG,
    high=NOON_DEG,
    nominal=NOON_DEG,
    meaning="elevation of the sun, which may stand in any direction",
    source="-6 degrees: the end of civil twilight (AMS Glossary of Meteorology)",
)
_HEIGHT = Quantity(
    key=BIRD_HEIGHT,
    low=BIRD_HEIGHTS_M[0],
    high=BIRD_HEIGHTS_M[1],
    nominal=3.0,
    meaning="height at which birds fly",
    source="engineering estimate: from above people's heads to above the search height",
)
CONDITIONS: Mapping[str, Quantity] = {
    each.key: each
    for each in (
        *WEATHER.values(),
        _LIGHT,
        # The sun's turn follows from its elevation and azimuth.
        *(each for key, each in QUANTITIES.items() if not key.startswith("light.")),
        _HEIGHT,
        *(
            told.quantity
            for told in STORY.values()
            if not told.quantity.choices and not told.is_place
        ),
    )
}
"""All that a domain may state, by ``group.name``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """Ranges of conditions, and who moves the NPCs.

    A condition without a range has its nominal value.  ``paper`` is set for the world of the paper,
    which states no ranges: eight weather genes, the sun's way over the day, and dense scenarios.
    """

    name: str
    npc_behaviour: str
    ranges: tuple[tuple[str, float, float], ...] = ()
    paper: WeatherRange | None = None
    built_in: bool = False

    def range_of(self, key: str) -> tuple[float, float] | None:
        """Return (low, high) of a condition, or None if it has its nominal value."""
        return next(((low, high) for name, low, high in self.ranges if name == key), None)

    @property
    def label(self) -> str:
        """The name; for a domain of a user's file with a digest of its ranges."""
        if self.built_in:
            return self.name
        digest = hashlib.sha256(repr(self).encode()).hexdigest()[:8]
        return f"{self.name} ({digest})"

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that have a range, in the order of the file format."""
        named = {key.partition(".")[0] for key, _, _ in self.ranges}
        return tuple(name for name in ("weather", "light", *GROUPS, "npcs") if name in named)

    def outside(self, scenario: Scenario, map: Map) -> tuple[str, ...]:
        """Return what of a scenario lies outside the domain, one phrase each."""
        if self.paper:
            return _outside_paper(scenario, map, self.paper)
        found = []
        objects = dict(map.all_objects)
        sections = sections_of(scenario, map)
        for head, values in sections.items():
            if head in objects and self.npc_behaviour == ABSENT:
                found.append(f"{head} is there, the domain has no NPCs")
            if head in objects:
                found += self._behaviour_outside(scenario, head)
            if head == "marker" or head in objects:
                continue
            for name, value in values.items():
                key = f"{head}.{name}"
                if key not in CONDITIONS:
                    continue
                problem = _beyond(key, value, self.range_of(key))
                if problem:
                    found.append(f"{key} = {_text_of(key, value)}, {problem}")
        return tuple(found)

    def _behaviour_outside(self, scenario: Scenario, name: str) -> tuple[str, ...]:
        story = story_of(scenario, name)
        if story is None or self.npc_behaviour not in GRADES:
            return ()
        if GRADES.index(story.grade) <= GRADES.index(self.npc_behaviour):
            return ()
        return (f"{name} is {story.grade}, the domain ends at {self.npc_behaviour}",)


def _beyond(key: str, value: float, limits: tuple[float, float] | None) -> str:
    nominal = CONDITIONS[key].nominal
    low, high = limits or (nominal, nominal)
    low, high = min(low, nominal), max(high, nominal)
    slack = _TOLERANCE * max(1.0, abs(value))
    if low - slack <= value <= high + slack:
        return ""
    ends = f"{_text_of(key, low)} to {_text_of(key, high)}"
    return f"the domain has {ends}" if limits else f"the domain has only {_text_of(key, nominal)}"


def _text_of(key: str, value: float) -> str:
    return QUANTITIES[key].text_of(value) if key in QUANTITIES else f"{value:g}"


def _outside_paper(scenario: Scenario, map: Map, weather: WeatherRange) -> tuple[str, ...]:
    tops = {each.key: each.high for each in genome_for(map, weather=weather).properties}
    found = []
    for key, value in scenario.genes:
        if key in QUANTITIES and value != QUANTITIES[key].nominal:
            text = _text_of(key, value)
            found.append(f"{key} = {text}, the paper's world has only nominal values of it")
        elif value > tops.get(key, value) + _TOLERANCE:
            unit = WEATHER[key]
            found.append(
                f"{unit.name} = {unit.at(value):g}, the domain ends at {unit.at(tops[key]):g}"
            )
    return tuple(found)
