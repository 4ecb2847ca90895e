"""The genome of a domain: what may vary in its scenarios on one map."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pytest_garl.scenarios.domains.domain import ABSENT, BIRD_HEIGHT, ELEVATION, Domain
from pytest_garl.scenarios.genes import (
    ACTIVE,
    CompositeGene,
    Genome,
    NuclearGene,
    genome_for,
    object_gene,
    place_gene,
    sun_value,
    weather_value,
    within,
)
from pytest_garl.scenarios.genome_like import story_property
from pytest_garl.scenarios.groups import (
    DECIDED,
    EVENT_MOMENTS,
    GROUPS,
    QUANTITIES,
    WEATHER,
    WEATHER_CAUSES,
)
from pytest_garl.scenarios.light import position_of_elevation
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.story import GRADES, STORY
from pytest_garl.scenarios.task import Task

_NO_RANGE = 1e-9
"""A range that files round to one value."""


def genome_of(
    domain: Domain, map: Map, task: Task | None = None, *, is_dense: bool = False
) -> Genome:
    """Return the genome of the domain's scenarios on ``map``.

    Every group, every cause of weather and every NPC has a bit of activity, unless the domain
    excludes its nominal values.  The world of the paper has none.  Few are
    active in a drawn scenario, all in one of a dense genome.
    """
    if domain.paper:
        return genome_for(map, weather=domain.paper, task=task)
    fixed: dict[str, float] = {}
    composites = [
        CompositeGene(name="environment", genes=tuple(_weather(domain))),
        CompositeGene(name="light", genes=tuple(_light(domain))),
        CompositeGene(
            name="marker",
            genes=(place_gene("marker", "position", "place of the marker in its disc of 7.5 m"),),
        ),
        CompositeGene(name="objects", genes=tuple(_objects(domain, map))),
    ]
    for name in GROUPS:
        values = []
        for key in GROUPS[name].keys:
            limits = domain.range_of(key)
            if limits and limits[0] == limits[1]:
                fixed[key] = limits[0]
            elif limits:
                values.append(within(QUANTITIES[key], *_drawn(domain, key, limits)))
        if values:
            composites.append(CompositeGene(name=name, genes=(_optional(name, values),)))
    return Genome(
        composites=tuple(each for each in composites if each.genes),
        task=Task(marker=map.marker) if task is None else task,
        fixed=tuple(fixed.items()),
        is_dense=is_dense,
        removed=tuple(name for name, _ in map.present_objects)
        if domain.npc_behaviour == ABSENT
        else (),
    )


def _drawn(domain: Domain, key: str, limits: tuple[float, float]) -> tuple[float, float]:
    """Return the limits of draws of a condition.

    Where NPCs may interfere, half of the events that may wait for the director's decision do, as
    more than half of the stories of such NPCs.  Elsewhere nobody decides, and none does.
    """
    low, high = limits
    decision = EVENT_MOMENTS.index(DECIDED)
    if not key.endswith(".after") or high < decision:
        return limits
    if domain.npc_behaviour not in GRADES[1:]:
        return low, decision - 1.0
    # A moment is drawn as a rounded number: the others reach from low to half below the decision.
    return low, 2 * (decision - 0.5) - low


def _optional(name: str, values: Iterable[Quantity], *, may_rest: bool = True) -> NuclearGene:
    """Return a gene with a bit of activity, unless one of its nominal values is not allowed."""
    values = tuple(values)
    if not may_rest or any(_excludes_nominal(each) for each in values):
        return NuclearGene(name=name, properties=values)
    bit = Quantity(
        key=f"{ACTIVE}{name}",
        low=0.0,
        high=1.0,
        nominal=0.25,
        meaning=f"{name} acts above 0.5",
        even=True,
    )
    return NuclearGene(name=name, properties=(bit, *values))


def _excludes_nominal(item: Quantity) -> bool:
    return item.key in QUANTITIES and item.nominal != QUANTITIES[item.key].nominal


def _weather(domain: Domain) -> Iterable[NuclearGene]:
    for cause, names in WEATHER_CAUSES.items():
        values, may_rest = [], True
        for name in names:
            key = f"environment.{name}"
            unit = WEATHER[key]
            limits = domain.range_of(unit.key)
            if limits is None:
                continue
            low, high = sorted(0.0 if math.isinf(each) else unit.share_of(each) for each in limits)
            if low == high == 0:
                continue
            may_rest &= low == 0
            values.append(weather_value(key, low, max(high, math.nextafter(low, 1.0)), even=False))
        if values:
            yield _optional(cause, values, may_rest=may_rest)


def _light(domain: Domain) -> Iterable[NuclearGene]:
    limits = domain.range_of(ELEVATION)
    if limits is None or limits[0] == limits[1]:
        return
    position = sun_value(position_of_elevation(limits[0]), even=False)
    yield _optional("light", (position, QUANTITIES["light.turn_deg"]))


def _story(domain: Domain, name: str, kind: str) -> Iterable[Quantity]:
    """Yield the values of an NPC's story, if the domain names a grade of behaviour."""
    if domain.npc_behaviour not in GRADES:
        return
    strongest = GRADES.index(domain.npc_behaviour)
    for each in STORY.values():
        low, high = each.draws
        if each.name == "grade":
            high = strongest + high % 1
        elif not each.quantity.choices and not each.is_place:
            nominal = each.quantity.nominal
            limits = domain.range_of(each.quantity.key) or (nominal, nominal)
            low, high = (limits[0] if low >= 0 else -limits[1]), limits[1]
        if kind in each.types:
            # A value that the domain fixes is part of every story too.
            yield story_property(name, each, (low, max(high, low + _NO_RANGE)))


def _objects(domain: Domain, map: Map) -> Iterable[NuclearGene]:
    if domain.npc_behaviour == ABSENT:
        return
    heights = domain.range_of(BIRD_HEIGHT)
    for name, kind in map.present_objects:
        values = list(object_gene(name).properties)
        if OBJECT_TYPES[kind].flies and heights:
            low, high = heights
            values.append(
                Quantity(
                    key=f"{name}.height_m",
                    low=low,
                    high=high,
                    nominal=min(high, max(low, OBJECT_TYPES[kind].altitude_m)),
                    meaning="height at which it flies",
                    even=True,
                )
            )
        values += _story(domain, name, kind)
        yield _optional(name, values)
