"""Searches of flights by a formula, for the tests of breeding."""

from __future__ import annotations

import importlib.util

import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, Method, SearchPlan
from pytest_garl.search.method_catalogue import USE, declaration_of, method_names
from pytest_garl.verdicts.verdict import Margin
from tests.support.results import flight_result

MAP = load_map("court")
GENOME = genome_for(MAP)


def plan(seed: int = 0, population: int = 8) -> SearchPlan:
    return SearchPlan(map=MAP, genome=GENOME, seed=seed, flights=40, population=population)


def result(scenario: Scenario) -> FlightResult:
    """Fog keeps it from the marker; a fast dog hits it."""
    fog, hit = scenario["environment.fog"], scenario["dog-1.velocity"] > 0.9
    far = 10 * fog
    margins = (
        Margin(property="distance", value=1.5 - far, unit="m", decided=not hit),
        Margin(property="collision", value=0.0 if hit else 2.0, unit="m"),
    )
    if hit:
        return flight_result("IV:dog", margins=margins, final_distance_m=far)
    if far > 1.5:
        return flight_result(
            "off", outcome="landed", primary="distance", margins=margins, final_distance_m=far
        )
    return flight_result(margins=margins, final_distance_m=far)


def bred(method: Method, generations: int) -> list[list[Scenario]]:
    made = []
    for _ in range(generations):
        made.append(list(method.ask()))
        method.tell([FlownScenario(scenario=each, result=result(each)) for each in made[-1]])
    return made


def every_method(*without: str) -> list[object]:
    """Return the shipped methods as parameters; one that needs PyTorch is skipped without it.

    The one that draws from a model of use is left out: it needs one (``methods/test_use.py``).
    """
    has_torch = importlib.util.find_spec("torch") is not None
    return [
        pytest.param(
            name,
            marks=pytest.mark.skipif(
                bool(declaration_of(name).extra) and not has_torch, reason="needs PyTorch"
            ),
        )
        for name in sorted({*method_names()} - {USE, *without})
    ]
