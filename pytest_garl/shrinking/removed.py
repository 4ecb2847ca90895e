"""What shrinking removed from a scenario: objects, conditions, and the values of these."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Self

from pytest_garl.cases.case import NOTHING
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.scenario import Scenario

_OBJECTS = re.compile(r"(\d+) of (\d+) objects?")
_CONDITIONS = re.compile(r"(\d+) of (\d+) conditions?(?: \((\d+) of (\d+) values\))?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """How many objects, conditions and values off nominal a scenario has.

    Conditions are those of a severity, and a marker that is not at its nominal place.
    """

    objects: int = 0
    conditions: int = 0
    values: int = 0

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Return those of a scenario."""
        conditions = active_conditions(scenario)
        is_moved = scenario.has_moved_marker
        return cls(
            objects=sum(key.endswith(".velocity") for key, _ in scenario.genes),
            conditions=len(conditions) + is_moved,
            values=sum(len(each.values) for each in conditions) + is_moved,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Removed:
    """What was removed of what was there."""

    removed: Contents
    there: Contents

    @classmethod
    def between(cls, before: Scenario, after: Scenario) -> Self:
        """Return what the second scenario lacks of the first."""
        first, second = Contents.of(before), Contents.of(after)
        return cls(
            removed=Contents(
                objects=max(0, first.objects - second.objects),
                conditions=max(0, first.conditions - second.conditions),
                values=max(0, first.values - second.values),
            ),
            there=first,
        )

    @property
    def text(self) -> str:
        """It in words, without what was not there: ``2 of 3 objects, 1 of 2 conditions``.

        Values are said if they are more than conditions.
        """
        removed, there = self.removed, self.there
        if removed == Contents():
            return NOTHING
        told = []
        if there.objects:
            told.append(f"{removed.objects} of {_counted(there.objects, 'object')}")
        if there.conditions:
            text = f"{removed.conditions} of {_counted(there.conditions, 'condition')}"
            if there.values > there.conditions:
                text += f" ({removed.values} of {there.values} values)"
            told.append(text)
        return ", ".join(told)

    @classmethod
    def parse(cls, text: str) -> Self | None:
        """Return what a text says, None for a text of another form."""
        objects = _OBJECTS.search(text)
        conditions = _CONDITIONS.search(text)
        counts = [[0, 0], [0, 0], [0, 0]]
        if objects:
            counts[0] = [int(each) for each in objects.groups()]
        if conditions:
            counts[1] = [int(each) for each in conditions.groups()[:2]]
            counts[2] = [int(each) for each in conditions.groups()[2:] if each] or counts[1]
        removed, there = (
            Contents(objects=one, conditions=two, values=three)
            for one, two, three in zip(*counts, strict=True)
        )
        found = cls(removed=removed, there=there)
        return found if found.text == text else None


def all_removed(before: str, after: str) -> str:
    """Return in words what shrinking removed, this time and the times before.

    A text without counts adds nothing: a person may have changed it.
    """
    if NOTHING in (before, after):
        return after if before == NOTHING else before
    first, second = Removed.parse(before), Removed.parse(after)
    if first is None or second is None:
        return after
    one, two = first.removed, second.removed
    removed = Contents(
        objects=one.objects + two.objects,
        conditions=one.conditions + two.conditions,
        values=one.values + two.values,
    )
    return Removed(removed=removed, there=first.there).text


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
