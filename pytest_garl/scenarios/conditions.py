"""The conditions of a scenario that are not nominal: by cause, how strong, in a few words."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from pytest_garl.scenarios.genes import SUN
from pytest_garl.scenarios.groups import (
    DECIDED,
    EVENT_MOMENTS,
    GROUPS,
    QUANTITIES,
    WEATHER,
    WEATHER_CAUSES,
)
from pytest_garl.scenarios.light import sun_elevation_deg
from pytest_garl.scenarios.quantities import UNITS, Group, Quantity, significant, unit_of
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY_MOMENTS, when_in_words
from pytest_garl.scenarios.units import TURN

LIGHT_GROUP = "light"
TOLD_GROUP, TOLD_ERROR = "told", "told.error_m"
NOON = 0.5
"""The nominal position of the sun."""
MOST_NAMED = 3
"""More values of one cause than these are counted and not named."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveCondition:
    """One cause that is not nominal: fog, the light, the wind.

    ``share`` (0..1) is how far its strongest value lies from nominal, as a share of all that can be
    flown; 0 if its values are only kinds, directions and times.  ``words`` say that value.
    ``values`` say all that are not nominal; directions and times only if nothing else is there, or
    if they may act alone.
    ``when`` says for an event that waits for a moment of the landing when it begins.
    """

    cause: str
    share: float
    words: str
    values: tuple[str, ...]
    when: str = ""

    @property
    def named(self) -> str:
        """Its values in words, ``dirt 30 %``; more than three are counted, ``5 values``."""
        counted = f"{len(self.values)} values"
        text = counted if len(self.values) > MOST_NAMED else ", ".join(self.values)
        return f"{self.when}, {text}" if self.when else text


def active_conditions(scenario: Scenario) -> tuple[ActiveCondition, ...]:
    """Return the causes of weather, the light and the groups that are not nominal."""
    found = []
    for cause, names in WEATHER_CAUSES.items():
        genes = {name: scenario.get(f"environment.{name}", 0.0) for name in names}
        values = [
            _Value(gene, _weather(cause, name, gene)) for name, gene in genes.items() if gene > 0
        ]
        found += _condition(cause, values)
    found += _condition(LIGHT_GROUP, _light(scenario))
    for name, group in GROUPS.items():
        # A surveyed pad whose coordinate has no error is as good as it gets.
        is_exact = name == TOLD_GROUP and scenario[TOLD_ERROR] == 0
        if name != LIGHT_GROUP and not is_exact:
            when = _when(scenario, name)
            found += [
                dataclasses.replace(each, when=when)
                for each in _condition(name, list(_values(scenario, group)))
            ]
    return tuple(found)


def _when(scenario: Scenario, group: str) -> str:
    """Return when an event begins, empty if its time counts from the start of the flight."""
    key = f"{group}.after"
    number = int(QUANTITIES[key].flown(scenario[key])) if key in QUANTITIES else 0
    if not number:
        return ""
    delay_s = 0.0 if EVENT_MOMENTS[number] == DECIDED else scenario[f"{group}.from_s"]
    return when_in_words(STORY_MOMENTS.index(EVENT_MOMENTS[number]), delay_s)


_CAUSE_OF_WEATHER = {
    f"environment.{name}": cause for cause, names in WEATHER_CAUSES.items() for name in names
}


def cause_of_key(key: str) -> str:
    """Return the cause to which the gene of a scenario belongs: ``fog``, ``light``, ``wind``."""
    if key in (SUN, TURN):
        return LIGHT_GROUP
    return _CAUSE_OF_WEATHER.get(key, key.partition(".")[0])


def unread_groups(scenario: Scenario, data_read: Collection[str] | None) -> tuple[str, ...]:
    """Return the groups that are not nominal and change only data that was never read.

    ``data_read`` are the fields of an observation that the landing system read in the flight of the
    scenario; if nobody knows (None), no group is named.
    """
    if data_read is None:
        return ()
    return tuple(
        name
        for name, group in GROUPS.items()
        if group.feeds and group.feeds not in data_read and any(_values(scenario, group))
    )


def without_groups(scenario: Scenario, names: Collection[str]) -> Scenario:
    """Return a scenario in which these groups are nominal."""
    nominal = {key: value for name in names for key, value in GROUPS[name].nominal.items()}
    return scenario.replace(nominal) if nominal else scenario


class _Value(NamedTuple):
    """A value that is not nominal: how far, in words, and whether it may matter alone."""

    share: float
    words: str
    acts_alone: bool = False


def _condition(cause: str, values: list[_Value]) -> list[ActiveCondition]:
    if not values:
        return []
    strongest = max(values, key=lambda each: each.share)
    named = tuple(each.words for each in values if each.share > 0 or each.acts_alone)
    return [
        ActiveCondition(
            cause=cause,
            share=round(min(1.0, strongest.share), 4),
            words=strongest.words,
            values=named or (strongest.words,),
        )
    ]


def _weather(cause: str, name: str, gene: float) -> str:
    weather = WEATHER[f"environment.{name}"]
    return _in_words(cause, weather.name, weather.at(gene))


def _light(scenario: Scenario) -> list[_Value]:
    position = scenario.get(SUN, NOON)
    if position == NOON and scenario[TURN] == 0:
        return []
    up_deg = round(sun_elevation_deg(position))
    words = f"sun {abs(up_deg)} degrees {'below the horizon' if up_deg < 0 else 'high'}"
    return [_Value(abs(position - NOON) / NOON, words)]


def _values(scenario: Scenario, group: Group) -> Iterator[_Value]:
    for each in group.quantities:
        value = scenario[each.key]
        if value != each.nominal and each.name != "after":
            yield _Value(_share(each, value), _value_in_words(each, value), each.acts_alone)


def _share(quantity: Quantity, value: float) -> float:
    """Return how far a value is from nominal, 0 if it has no harsher end."""
    if not quantity.has_harsher_end:
        return 0.0
    nominal = quantity.nominal
    reach = max(quantity.high - nominal, nominal - quantity.low)
    return abs(value - nominal) / reach if math.isfinite(reach) else 0.0


def _value_in_words(quantity: Quantity, value: float) -> str:
    if quantity.choices:
        return quantity.text_of(value)
    cause, _, name = quantity.key.partition(".")
    return name if quantity.is_switch else _in_words(cause, name, value)


def _in_words(cause: str, name: str, value: float) -> str:
    """Return such as ``visibility 11 m`` for the name and the value of ``fog_visibility_m``."""
    ending = next((ending for ending in UNITS if name.endswith(ending)), "")
    words = [word for word in name.removesuffix(ending).split("_") if word != cause]
    return " ".join([*words, f"{significant(value, 2):g}", unit_of(name)]).strip()
