"""How a case compares with what it was made from: what was removed, and whether it is simpler."""

from __future__ import annotations

import dataclasses
import itertools
import re
from dataclasses import dataclass
from typing import Self

from pytest_garl.cases.case import NOTHING, Case
from pytest_garl.cases.case_file import record_lines, size_of
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.plan import NEIGHBOURS
from pytest_garl.shrinking.simplification import complexity, genome_of_scenario

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Simplicity:
    """The respects in which two cases of one failure are compared; less of each is better.

    The strongest grade of an object; objects; genes off nominal and their distance from it;
    decisions at which an object moves, and runs of equal moves; characters of the record in the
    file; neighbours that do not fail or were not flown; how much less the case asks of a repair;
    whether the evidence comes from other sources than today's.
    """

    grade: int
    objects: int
    genes: int
    distance: float
    moving: int
    runs: int
    characters: int
    doubtful_neighbours: int
    excused: int
    outdated: bool


def simplicity(case: Case, map: Map, *, outdated: bool = False) -> Simplicity:
    """Return how simple a case is."""
    found = complexity(case.scenario, genome_of_scenario(case.scenario, map))
    evidence = case.evidence
    return Simplicity(
        grade=found.grade,
        objects=found.objects,
        genes=found.genes,
        distance=found.distance,
        moving=sum(move != (0.0, 0.0) for _, own in case.moves for move in own),
        runs=sum(len(list(itertools.groupby(own))) for _, own in case.moves),
        characters=sum(len(line) for line in record_lines(case)),
        doubtful_neighbours=max(NEIGHBOURS, evidence.neighbours) - evidence.neighbours_failed,
        excused=_excused(case),
        outdated=outdated,
    )


def _excused(case: Case) -> int:
    """Return how much less a case asks of a repair: of recorded moves only, or nothing."""
    if case.prevention.answer in ("sensor-limited", "unpreventable"):
        return 2
    return 0 if case.live else 1


def no_worse(one: Simplicity, other: Simplicity) -> bool:
    """Return whether ``one`` is at least as simple as ``other`` in every respect."""
    names = [field.name for field in dataclasses.fields(Simplicity)]
    return all(getattr(one, name) <= getattr(other, name) for name in names)


def is_simpler(case: Case, saved: Case, map: Map, *, outdated: bool) -> bool:
    """Return whether a case is no worse than the saved one and better in one respect.

    ``outdated`` says that the saved case's evidence comes from other sources than today's.
    """
    one, other = simplicity(case, map), simplicity(saved, map, outdated=outdated)
    if one == other:
        return size_of(case, map) < size_of(saved, map)
    return no_worse(one, other)
