"""The cause of a saved case: the conditions and objects that shrinking has left."""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.cases.case import Case
from pytest_garl.scenarios.conditions import LIGHT_GROUP, NOON, active_conditions
from pytest_garl.scenarios.genes import SUN
from pytest_garl.scenarios.groups import GROUPS, WEATHER_CAUSES
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.verdicts.ending import DECOY, NAMED_BY_THEMSELVES

_BODIES = ("III", "IV")
"""Types of violations whose signature names the body that was hit."""
_DECOY_GROUP = "decoy-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """Conditions by name, and kinds of objects: all dogs are alike.

    A body, decoy, exception or test that the ending names is no part of it: a flight with this
    ending has it.  So the cause may be empty, as that of a case that fails with nothing unusual.
    """

    conditions: frozenset[str] = frozenset()
    objects: frozenset[str] = frozenset()

    def __bool__(self) -> bool:
        """Return whether it takes anything."""
        return bool(self.conditions or self.objects)

    def __or__(self, other: Cause) -> Cause:
        """Return all that two causes take."""
        return Cause(
            conditions=self.conditions | other.conditions, objects=self.objects | other.objects
        )

    def acts_in(self, scenario: Scenario) -> bool:
        """Return whether any of it is in a scenario; an empty cause is in all."""
        return not self or bool(
            self.conditions & _conditions_in(scenario) or self.objects & _kinds_in(scenario)
        )

    def is_in(self, scenario: Scenario) -> bool:
        """Return whether all of it is in a scenario."""
        return self.conditions <= _conditions_in(scenario) and self.objects <= _kinds_in(scenario)

    def made_nominal(self, scenario: Scenario, map: Map) -> Scenario:
        """Return the twin of a scenario: the same without the cause."""
        values: dict[str, float] = {}
        for name in self.conditions:
            if name in GROUPS:
                values |= GROUPS[name].nominal
            weather = [f"environment.{each}" for each in WEATHER_CAUSES.get(name, ())]
            values |= {key: 0.0 for key in weather if scenario.get(key, 0.0) > 0}
            if name == LIGHT_GROUP and scenario.get(SUN, NOON) != NOON:
                values[SUN] = NOON
        gone = [name for name in _objects_in(scenario) if _kind_of(name) in self.objects]
        return repair(scenario.replace(values).without(*gone), map)

    @property
    def text(self) -> str:
        """It in words: ``fog and person``; ``nothing unusual`` if it is empty."""
        return " and ".join(sorted({*self.conditions, *self.objects})) or "nothing unusual"


def cause_of_case(case: Case) -> Cause:
    """Return what a case states as not nominal, without what its ending names."""
    ending = case.ending
    conditions = _conditions_in(case.scenario)
    if ending.startswith(DECOY):
        conditions = frozenset(each for each in conditions if not each.startswith(_DECOY_GROUP))
        return Cause(conditions=conditions)
    if ending.partition(":")[0] in _BODIES:
        # As the search found it, a collision has conditions that the body does not need.
        return Cause(conditions=conditions if case.is_shrunk else frozenset())
    if ending.partition(":")[0] in NAMED_BY_THEMSELVES:
        return Cause()
    return Cause(conditions=conditions, objects=_kinds_in(case.scenario))


def _conditions_in(scenario: Scenario) -> frozenset[str]:
    return frozenset(each.cause for each in active_conditions(scenario))


def _kinds_in(scenario: Scenario) -> frozenset[str]:
    return frozenset(_kind_of(name) for name in _objects_in(scenario))


def _objects_in(scenario: Scenario) -> list[str]:
    return [key.partition(".")[0] for key, _ in scenario.genes if key.endswith(".velocity")]


def _kind_of(name: str) -> str:
    """Return such as ``dog`` for ``dog-1``."""
    return name.rpartition("-")[0] or name
