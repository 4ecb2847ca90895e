"""Robustness: a violation that slightly different scenarios do not share sits on an edge."""

from __future__ import annotations

import numpy as np

from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY
from pytest_garl.scenarios.validity import repair
from pytest_garl.shrinking.plan import NEIGHBOURS
from pytest_garl.shrinking.simplification import CHOICES, genome_of_scenario

JITTER = 0.002
"""Largest change of a gene, as a share of its range: 1.5 cm of the marker's disc, 2 to 8 cm of an
object's start, a hundredth of a metre per second.  That is more than two CPUs differ, and less than
a person would call another scenario."""


def neighbours(scenario: Scenario, map: Map) -> tuple[Scenario, ...]:
    """Return slightly different scenarios, always the same ones.

    Nominal weather stays nominal, and a choice, such as the grade of an object, stays as it is.
    """
    rng = np.random.default_rng([scenario.seed, 0])
    present = dict(scenario.genes)
    items = [
        item
        for item in genome_of_scenario(scenario, map).properties
        if item.key in present
        and (present[item.key] != item.nominal or not item.key.startswith("environment."))
        and not item.key.endswith(CHOICES)
    ]
    found = []
    for _ in range(NEIGHBOURS):
        steps = rng.uniform(-JITTER, JITTER, len(items))
        moved = {
            item.key: float(np.clip(present[item.key] + step * _range(item), item.low, item.high))
            for item, step in zip(items, steps, strict=True)
        }
        found.append(repair(scenario.replace(moved), map))
    return tuple(found)


def _range(item: Quantity) -> float:
    """Return the width of a gene's range; of an object's story that which a search draws from.

    What can be flown is six times as wide: a bird would come four metres too late.
    """
    head, _, name = item.key.partition(".")
    if head in GROUPS or name not in STORY:
        return item.high - item.low
    low, high = STORY[name].draws
    return high - low
