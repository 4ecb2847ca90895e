"""Searches of flights by a formula, for the tests of breeding."""

from __future__ import annotations

from typing import Any

from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import Flown, Method, SearchPlan

MAP = load_map("court")
GENOME = genome_for(MAP)


def plan(seed: int = 0, population: int = 8) -> SearchPlan:
    return SearchPlan(map=MAP, genome=GENOME, seed=seed, population=population)


def result(scenario: Scenario) -> dict[str, Any]:
    """Fog keeps it from the marker; a fast dog hits it."""
    fog, hit = scenario["environment.fog"], scenario["dog-1.velocity"] > 0.9
    far = 10 * fog
    primary = "collision" if hit else "distance" if far > 1.5 else None
    margins = [
        {"property": "distance", "value": 1.5 - far, "unit": "m", "decided": not hit, "reason": ""},
        {"property": "collision", "value": 0.0 if hit else 2.0, "unit": "m", "decided": True},
    ]
    signature = {"collision": "IV:dog", "distance": "off"}.get(primary or "", "")
    verdict = {"primary": primary, "signature": signature, "margins": margins}
    return {
        "outcome": "collision" if hit else "landed",
        "final_distance_m": far,
        "elapsed_s": 30.0,
        "closest_call": "",
        "closest_body": "",
        "verdict": verdict,
    }


def bred(method: Method, generations: int) -> list[list[Scenario]]:
    made = []
    for _ in range(generations):
        made.append(list(method.ask()))
        method.tell([Flown(scenario=each, result=result(each)) for each in made[-1]])
    return made
