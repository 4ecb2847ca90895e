from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from lab.stand_in import stand_in
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.columns import STRATA, Columns
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import Garl, GarlParameters
from pytest_garl.search.methods.random import RandomSearch

MAP = load_map("court")
GENOME = genome_of(domain_named("field"), MAP)
PLAN = SearchPlan(map=MAP, genome=GENOME, seed=0, population=20)


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


def test_a_search_finds_kinds_more_evenly_than_chance() -> None:
    def even(found: Counter[str]) -> float:
        """Return the inverse of Simpson's concentration: the number of kinds as if all even."""
        return found.total() ** 2 / sum(count**2 for count in found.values())

    plans = [SearchPlan(map=MAP, genome=GENOME, seed=seed, population=20) for seed in range(3)]
    by_garl = [even(signatures(Garl(plan), 12)) for plan in plans]
    by_chance = [even(signatures(RandomSearch(plan), 12)) for plan in plans]
    assert np.mean(by_garl) > 1.5 * np.mean(by_chance)


def test_the_first_generation_is_the_one_that_random_flies() -> None:
    assert Garl(PLAN).ask() == RandomSearch(PLAN).ask()


def test_nothing_is_bred_before_a_hundred_scenarios_but_in_a_dense_world() -> None:
    for genome, bred_from in ((GENOME, 5), (genome_for(MAP), 2)):
        plan = SearchPlan(map=MAP, genome=genome, seed=0, population=20)
        method, known = Garl(plan), set[int]()
        inherited = []
        for _ in range(12):
            scenarios = method.ask()
            inherited.append(any(each.seed in known for each in scenarios))
            known |= {each.seed for each in scenarios}
            method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
        # A child has its parent's seed.
        assert inherited.index(True) == bred_from


def test_all_strata_are_flown() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=1.0))
    columns, rows = Columns(GENOME), []
    for generation in range(4):
        scenarios = method.ask()
        method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
        # The first generation is random.
        rows += [encode(each, GENOME) for each in scenarios if generation > 0]
    assert {columns.stratum(row) for row in rows} == {*STRATA}


def test_a_scenario_that_is_flown_like_an_earlier_one_is_not_flown_again() -> None:
    method, texts = Garl(PLAN), Counter[str]()
    for _ in range(8):
        scenarios = method.ask()
        texts.update(dump_scenario(each) for each in scenarios)
        method.tell(told(scenarios, [stand_in(each, MAP) for each in scenarios]))
    assert set(texts.values()) == {1}
