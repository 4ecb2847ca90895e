"""Rules over conditions that say where a landing system fails: "wind above 4 m/s, a dog is there".

A rule is a conjunction of at most three conditions, each on one quantity of a scenario.  It is
learned in these steps:

1. Every quantity with a harsher end becomes a feature: its value, or how far it lies from nominal
   if both sides are harsh.  So does whether a condition acts, whether an NPC of a type is there and
   how much it knows of the UAV, and each kind of a decoy.
2. A beam search adds one condition after the other, a feature above or below a threshold.
   Thresholds lie half-way between two values.
3. The best rule has the largest *weighted relative accuracy*: the share of all scenarios that it
   covers, times how much more of these fail than of all (Lavrac, Flach and Zupan 1999).  So a rule
   is worth more if it covers more, and a rule that says nothing is worth 0.
4. A condition that adds little is left out, so that few flights give short rules.

All is deterministic, and takes some 0.1 s for 400 scenarios.

For example: of 400 flights 40 fail, 30 of these among the 60 with a wind above 4 m/s.  The rule
"wind.mean_mps above 4" is worth 60 / 400 * (30 / 60 - 40 / 400) = 0.06.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.genes import SUN
from pytest_garl.scenarios.groups import DECOY_KINDS, GROUPS, QUANTITIES, WEATHER
from pytest_garl.scenarios.light import sun_elevation_deg
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import UNITS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES

Matrix = NDArray[np.float64]
Mask = NDArray[np.bool_]

MOST_CONDITIONS = 3
BEAM = 8
"""How many rules are kept at each step, so that two conditions are found that matter together."""
THRESHOLDS = 12
"""Thresholds that are tried for a feature."""
LEAST_GAIN = 0.1
"""A further condition makes a rule worth at least this share more."""
LEAST_FAILING = 8
"""A rule is learned from at least this many failing scenarios."""
LEAST_COVERED = 4
"""A rule covers at least this many of them."""
ABOVE, BELOW = "above", "below"


@dataclass(frozen=True, slots=True, kw_only=True)
class Feature:
    """One quantity of a scenario as rules see it.

    ``is_there`` marks one that is 1 or 0, which ``name`` says as a clause; else ``unit`` and
    ``shown`` put a threshold into words.  ``inverse`` is that of a feature whose larger values a
    reader calls smaller, as extinction and visibility.
    """

    name: str
    unit: str = ""
    is_there: bool = False
    absent: str = ""
    inverse: bool = False
    shown: Callable[[float], float] = float

    def words(self, side: str, threshold: float) -> str:
        """Return a condition on it in words."""
        if self.is_there:
            return self.name if side == ABOVE else self.absent
        said = {ABOVE: BELOW, BELOW: ABOVE}[side] if self.inverse else side
        return f"{self.name} {said} {self.shown(threshold):.3g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """A feature, by its key, above or below a threshold."""

    key: str
    side: str
    threshold: float
    words: str

    def covers(self, table: Mapping[str, Matrix]) -> Mask:
        """Return which scenarios of a table fulfil it."""
        values = table[self.key]
        found: Mask = values > self.threshold if self.side == ABOVE else values <= self.threshold
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A conjunction of conditions."""

    conditions: tuple[Condition, ...]

    @property
    def words(self) -> str:
        """The rule for a reader."""
        return ", ".join(each.words for each in self.conditions)

    def covers(self, table: Mapping[str, Matrix]) -> Mask:
        """Return which scenarios of a table fulfil all conditions, shape (n,)."""
        found: Mask = np.logical_and.reduce([each.covers(table) for each in self.conditions])
        return found


Values = Callable[[str, float], Matrix]
"""Returns the values of a gene in all scenarios, shape (n,), and a default where there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionTable:
    """What rules see of some scenarios: the values of each feature, shape (n,), by its key."""

    features: Mapping[str, Feature]
    values: Mapping[str, Matrix]

    def of(self, chosen: Mask) -> ConditionTable:
        """Return the table of some of the scenarios."""
        values = {key: each[chosen] for key, each in self.values.items()}
        return ConditionTable(features=self.features, values=values)


def table_of_scenarios(scenarios: Sequence[Scenario], map: Map) -> ConditionTable:
    """Return the table of scenarios on one map."""
    genes = [dict(each.genes) for each in scenarios]

    def values(key: str, default: float) -> Matrix:
        return np.array([each.get(key, default) for each in genes], dtype=np.float64)

    def is_there(name: str) -> Mask:
        return np.array([f"{name}.velocity" in each for each in genes], dtype=bool)

    return _table(values, is_there, map)


def _table(values: Values, is_there: Callable[[str], Mask], map: Map) -> ConditionTable:
    features: dict[str, Feature] = {}
    found: dict[str, Matrix] = {}
    for key, feature, column in (
        *_measured(values),
        *_decoys(values),
        *_npcs(values, is_there, map),
    ):
        features[key], found[key] = feature, column
    return ConditionTable(features=features, values=found)


def _measured(values: Values) -> Iterator[tuple[str, Feature, Matrix]]:
    """Yield weather, the sun, and the other quantities with a harsher end."""
    for key, unit in WEATHER.items():
        inverse = unit.scale == "inverse"
        name = _label(unit.name)
        feature = Feature(name=name, unit=unit.unit, inverse=inverse, shown=unit.at)
        yield key, feature, values(key, 0.0)
    # The middle of the day is nominal.
    elevation = np.array([sun_elevation_deg(float(each)) for each in values(SUN, 0.5)])
    yield SUN, Feature(name="sun elevation", unit="degrees"), elevation
    for key, item in QUANTITIES.items():
        if item.has_harsher_end:
            column, name = values(key, item.nominal), _label(key)
            if item.low < item.nominal < item.high:
                column, name = np.abs(column - item.nominal), f"{name} (either way)"
            yield key, Feature(name=name, unit=item.unit), column


def _label(key: str) -> str:
    """Return a key for a reader, without its unit: ``wind.mean_mps`` is ``wind mean``."""
    ending = next((each for each in UNITS if key.endswith(each)), "")
    return key.removesuffix(ending).replace(".", " ").replace("_", " ")


def _decoys(values: Values) -> Iterator[tuple[str, Feature, Matrix]]:
    keys = [key for name in GROUPS if (key := f"{name}.kind") in QUANTITIES]
    # A kind is rounded up.
    kinds = np.ceil(np.array([values(key, 0.0) for key in keys]))
    for number, kind in enumerate(DECOY_KINDS):
        if number:
            feature = Feature(name=f"a decoy {kind}", is_there=True, absent=f"no decoy {kind}")
            yield f"decoy {kind}", feature, np.any(kinds == number, axis=0) + 0.0


def _npcs(
    values: Values, is_there: Callable[[str], Mask], map: Map
) -> Iterator[tuple[str, Feature, Matrix]]:
    """Yield of each type of NPC, and of all, whether one is there, and how much it knows."""
    names: dict[str, list[str]] = {}
    for name, kind in map.all_objects:
        names.setdefault(kind, []).append(name)
    if len(names) > 1:
        names["NPC"] = [name for own in names.values() for name in own]
    for kind, own in names.items():
        there = np.array([is_there(name) for name in own])
        grades = np.floor(np.array([values(f"{name}.grade", 0.0) for name in own]))
        word = "an" if kind[0] in "aeioN" else "a"
        feature = Feature(name=f"{word} {kind}", is_there=True, absent=f"no {kind}")
        yield kind, feature, np.any(there, axis=0) + 0.0
        for number, grade in enumerate(GRADES):
            if number:
                told = f"{kind} that is {grade}{' or stronger' * (number < len(GRADES) - 1)}"
                feature = Feature(name=f"{word} {told}", is_there=True, absent=f"no {told}")
                yield f"{kind} {grade}", feature, np.any(there & (grades >= number), axis=0) + 0.0


def learn_rule(table: ConditionTable, fails: Mask) -> Rule | None:
    """Return the rule that says best which scenarios fail, shape (n,); None if none does."""
    if np.count_nonzero(fails) < LEAST_FAILING or fails.all():
        return None
    conditions = list(_conditions(table))
    if not conditions:
        return None
    masks = np.array([each.covers(table.values) for each in conditions])
    everything = np.ones(len(fails), dtype=bool)
    beam: list[tuple[float, tuple[int, ...], Mask]] = [(0.0, (), everything)]
    best_worth, best = 0.0, tuple[int, ...]()
    for _ in range(MOST_CONDITIONS):
        grown: dict[tuple[int, ...], tuple[float, Mask]] = {}
        for _, chosen, covered in beam:
            worth = _worth(masks, covered, fails)
            for place in np.argsort(-worth, kind="stable")[: 4 * BEAM]:
                own = tuple(sorted({*chosen, int(place)}))
                if len(own) > len(chosen) and worth[place] > 0:
                    grown[own] = float(worth[place]), covered & masks[place]
        order = sorted(grown.items(), key=lambda item: (-item[1][0], item[0]))
        beam = [(worth, chosen, covered) for chosen, (worth, covered) in order[:BEAM]]
        if not beam:
            break
        if beam[0][0] > best_worth * (1 + LEAST_GAIN):
            best_worth, best = beam[0][0], beam[0][1]
    return Rule(conditions=_tightest([conditions[place] for place in best])) if best else None


def _conditions(table: ConditionTable) -> Iterator[Condition]:
    """Yield the conditions that a rule may have."""
    for key, feature in table.features.items():
        values = np.unique(table.values[key])
        middles = (values[1:] + values[:-1]) / 2
        places = np.linspace(0, len(middles) - 1, min(THRESHOLDS, len(middles))).round()
        for middle in middles[places.astype(int)]:
            for side in (ABOVE, BELOW):
                words = feature.words(side, float(middle))
                yield Condition(key=key, side=side, threshold=float(middle), words=words)


def _worth(masks: NDArray[np.bool_], covered: Mask, fails: Mask) -> Matrix:
    """Return the weighted relative accuracy of each condition beside those that ``covered``."""
    failing = np.count_nonzero(masks[:, covered & fails], axis=1)
    all_covered = np.count_nonzero(masks[:, covered], axis=1)
    worth = (failing - all_covered * np.mean(fails)) / len(fails)
    return np.where(failing >= LEAST_COVERED, worth, 0.0)


def _tightest(conditions: Sequence[Condition]) -> tuple[Condition, ...]:
    """Return the conditions without those that another one on the same feature contains."""
    kept: dict[tuple[str, str], Condition] = {}
    for each in conditions:
        other = kept.get((each.key, each.side))
        sign = 1 if each.side == ABOVE else -1
        if other is None or sign * each.threshold > sign * other.threshold:
            kept[each.key, each.side] = each
    return tuple(kept.values())
