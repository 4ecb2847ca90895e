from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from lab.stand_in import stand_in
from pytest_garl.execution.flight_id import Slot
from pytest_garl.execution.result import FlightResult, Origin
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.genes import ON_ABOVE
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.columns import STRATA, Columns
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import EXPLORING, Garl, GarlParameters
from pytest_garl.search.methods.random import RandomSearch
from pytest_garl.search.objectives import SAFE_MARGINS
from tests.support.results import flight_result

MAP = load_map("court")
GENOME = genome_of(domain_named("field"), MAP)
PLAN = SearchPlan(map=MAP, genome=GENOME, seed=0, flights=120, population=20)


def signatures(method: Any, generations: int) -> Counter[str]:
    found: Counter[str] = Counter()
    for _ in range(generations):
        scenarios = method.ask()
        results = [stand_in(each, MAP) for each in scenarios]
        method.tell(told(scenarios, results))
        found.update(each.signature for each in results if each.signature)
    return found


def told(scenarios: Sequence[Scenario], results: Sequence[FlightResult]) -> list[FlownScenario]:
    pairs = zip(scenarios, results, strict=True)
    return [FlownScenario(scenario=scenario, result=result) for scenario, result in pairs]


def test_a_search_finds_more_kinds_than_chance() -> None:
    plans = [dataclasses.replace(PLAN, seed=seed) for seed in range(2)]
    bred = [len(signatures(Garl(plan), 6)) for plan in plans]
    drawn = [len(signatures(RandomSearch(plan), 6)) for plan in plans]
    assert sum(bred) > sum(drawn) + len(plans)


def test_the_first_generation_is_the_one_that_random_flies() -> None:
    assert Garl(PLAN).ask() == RandomSearch(PLAN).ask()


Made = list[tuple[Scenario, Origin]]


def flown(generations: int, plan: SearchPlan = PLAN, **parameters: Any) -> list[Made]:
    """Return the generations of a search, each scenario with its origin."""
    method, made = Garl(plan, GarlParameters(**parameters)), list[Made]()
    for _ in range(generations):
        scenarios = method.ask()
        made.append([*zip(scenarios, method.origins, strict=True)])
        method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
    return made


@pytest.mark.parametrize("share", [0.5, 0.6, 1.0])
@pytest.mark.parametrize(("population", "budget"), [(8, 30), (20, 80)])
def test_the_last_flights_are_bred_and_are_at_least_their_share_after_the_control(
    share: float, population: int, budget: int
) -> None:
    plan = dataclasses.replace(PLAN, flights=budget, population=population)
    made = flown(4, plan, bred_share=share)
    hows = [origin.how for generation in made for _, origin in generation][:budget]
    assert {*hows[:population]} == {"control"}
    later = hows[population:]
    bred = math.ceil(share * len(later) - 1e-9)
    assert later == ["stratified"] * (len(later) - bred) + ["bred"] * bred


def test_up_to_its_half_a_search_is_the_one_that_only_explores() -> None:
    def texts(made: Sequence[Made]) -> list[str]:
        return [dump_scenario(each) for generation in made for each, _ in generation]

    # Of 120 flights 20 are the control.
    ours, exploring = texts(flown(6)), texts(flown(6, bred_share=0))
    assert ours[:70] == exploring[:70]
    assert not {*ours[70:]} & {*exploring[70:]}


def test_a_child_has_whole_conditions_and_npcs_of_each_of_its_parents() -> None:
    made, columns = flown(6), Columns(GENOME)
    rows = {
        Slot(generation=g, index=i).id("court"): encode(scenario, GENOME)
        for g, generation in enumerate(made)
        for i, (scenario, _) in enumerate(generation)
    }
    optional = [slice(gene.bit, gene.values.stop) for gene in columns.optional]
    for number, generation in enumerate(made):
        for scenario, origin in generation:
            assert bool(origin.parents) == (origin.how == "bred")
            child = encode(scenario, GENOME)
            for parent in origin.parents:
                # Of the generation before nothing is known yet, but for the control.
                assert int(parent.split("-g")[1][:2]) <= max(0, number - 2)
                shared = [
                    own
                    for own in optional
                    if child[own.start] > ON_ABOVE and np.array_equal(child[own], rows[parent][own])
                ]
                assert shared
            assert len(origin.parents) != 1


def test_a_child_tells_what_the_model_expects_of_it() -> None:
    children = [each for made in flown(6) for _, each in made if each.how == "bred"]
    assert len(children) == 50
    for child in children:
        assert {*child.expected} == {*SAFE_MARGINS}
        assert child.fails is not None
        assert 0 <= child.fails <= 1


def test_a_shuffled_model_has_the_same_machinery_and_knows_nothing() -> None:
    def told_from_others(**parameters: Any) -> float:
        """Return by how much more a model expects of the children that violate something."""
        method, expected = Garl(PLAN, GarlParameters(**parameters)), dict[bool, list[float]]()
        for _ in range(6):
            scenarios, results = method.ask(), []
            for scenario, origin in zip(scenarios, method.origins, strict=True):
                violates = scenario["wind.mean_mps"] > 2
                results.append(flight_result("off" if violates else ""))
                if origin.fails is not None:
                    expected.setdefault(violates, []).append(origin.fails)
            method.tell(told(scenarios, results))
        return float(np.mean(expected[True]) - np.mean(expected[False]))

    assert told_from_others(bred_share=1) > 0.3
    assert abs(told_from_others(bred_share=1, shuffled=True)) < 0.1


def test_a_search_that_only_explores_breeds_nothing_and_flies_all_strata() -> None:
    method = Garl(PLAN, EXPLORING)
    columns, rows = Columns(GENOME), []
    for generation in range(4):
        scenarios = method.ask()
        assert {each.how for each in method.origins} == {"stratified" if generation else "control"}
        method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
        # The first generation is random.
        rows += [encode(each, GENOME) for each in scenarios if generation > 0]
    assert {columns.stratum(row) for row in rows} == {*STRATA}


def test_a_generation_that_nothing_can_be_crossed_for_is_stratified() -> None:
    made = flown(2, dataclasses.replace(PLAN, population=1))
    assert [[origin.how for _, origin in each] for each in made] == [["control"], ["stratified"]]


def test_a_scenario_that_is_flown_like_an_earlier_one_is_not_flown_again() -> None:
    method, texts = Garl(PLAN), Counter[str]()
    for _ in range(5):
        scenarios = method.ask()
        texts.update(dump_scenario(each) for each in scenarios)
        method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
    assert set(texts.values()) == {1}
