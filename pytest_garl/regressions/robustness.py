"""Robustness: a violation that slightly different scenarios do not share sits on an edge."""

from __future__ import annotations

import numpy as np

from pytest_garl.regressions.simplification import genome_of
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair

NEIGHBOURS = 3
"""Slightly different scenarios that are flown for each case."""
JITTER = 0.002
"""Largest change of a gene, as a share of its range: 1.5 cm of the marker's disc, 2 to 8 cm of an
object's start, a hundredth of a metre per second.  That is more than two CPUs differ, and less than
a person would call another scenario."""


def neighbours(scenario: Scenario, map: Map) -> tuple[Scenario, ...]:
    """Return slightly different scenarios, always the same ones; nominal weather stays nominal."""
    rng = np.random.default_rng([scenario.seed, 0])
    present = dict(scenario.genes)
    items = [
        item
        for item in genome_of(scenario, map).properties
        if item.key in present
        and (present[item.key] != item.nominal or not item.key.startswith("environment."))
    ]
    found = []
    for _ in range(NEIGHBOURS):
        steps = rng.uniform(-JITTER, JITTER, len(items))
        moved = {
            item.key: float(
                np.clip(present[item.key] + step * (item.high - item.low), item.low, item.high)
            )
            for item, step in zip(items, steps, strict=True)
        }
        found.append(repair(scenario.replace(moved), map))
    return tuple(found)
