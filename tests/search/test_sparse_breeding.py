"""What methods breed from sparse chromosomes stays sparse, and dense ones stay dense."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.verdicts.verdict import Margin
from tests.support.results import flight_result

COURT = load_map("court")
GENOME = genome_of(domain_named("field"), COURT)
DENSE = genome_of(domain_named("field"), COURT, is_dense=True)
PLAN = SearchPlan(map=COURT, genome=GENOME, seed=4, flights=100, population=20)
BIT = "active."
NPCS = {name for name, _ in COURT.present_objects}


def acting(scenario: Scenario) -> set[str]:
    goes = any(".destination_" in key for key, _ in scenario.genes)
    genome = with_destinations(GENOME) if goes else GENOME
    row = dict(zip(genome.keys, encode(scenario, genome), strict=True))
    return {key.removeprefix(BIT) for key in row if key.startswith(BIT) and row[key] > 0.5}


def result(scenario: Scenario) -> FlightResult:
    """Wind and NPCs make violations, all else near misses."""
    near = max(0.0, 6.0 - scenario["wind.mean_mps"]) / 4
    margins = (Margin(property="distance", value=near - 0.1, unit="m"),)
    hit = sorted(NPCS & acting(scenario))
    if hit:
        body = hit[0]
        collision = (Margin(property="collision", value=0.0, unit="m"),)
        return flight_result(f"IV:{body}", closest_call=f"IV:{body}", margins=collision)
    return flight_result("" if near > 0.1 else "off", margins=margins)


@pytest.mark.parametrize("name", ["garl", "ga", "garl-paper", "random"])
def test_bred_scenarios_have_at_most_three_active_groups(name: str) -> None:
    method = make_method(name, PLAN)
    for _ in range(5):
        scenarios = method.ask()
        assert max(len(acting(each)) for each in scenarios) <= 3
        if method.learns:
            method.tell([FlownScenario(scenario=s, result=result(s)) for s in scenarios])


def test_scenarios_without_parents_are_as_sparse_as_drawn_ones() -> None:
    found = []
    for seed in range(10):
        plan = dataclasses.replace(PLAN, seed=seed)
        found += [acting(each) for each in make_method("garl", plan).ask()]
    few = np.mean([len(each) <= 1 for each in found])
    assert 0.3 < few < 0.5
    assert {"fog", "rain", "snow", "leaves", "dust"} <= set().union(*found)


def test_all_optional_groups_act_in_a_scenario_of_a_dense_genome() -> None:
    optional = [gene.name for gene in GENOME.genes if gene.is_optional]
    scenarios = random_scenarios(COURT, DENSE, 3, 0, 20)
    assert {len(acting(each)) for each in scenarios} == {len(optional)}
