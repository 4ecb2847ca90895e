from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import FAR, NEAR, Garl, GarlParameters, cell_of
from pytest_garl.search.methods.random import RandomSearch
from pytest_garl.verdicts.paper_metrics import mean_distance
from pytest_garl.verdicts.verdict import Margin
from tests.support.results import flight_result

MAP = load_map("court")
PLAN = SearchPlan(map=MAP, genome=genome_for(MAP), seed=0, population=20)


def result(signature: str, closest_call: str = "", distance_m: float = 0.0) -> FlightResult:
    margin = Margin(property="collision", value=distance_m, unit="m")
    return flight_result(signature, closest_call=closest_call, margins=(margin,))


def common_and_rare(scenario: Scenario) -> FlightResult:
    """Hit a fast dog in a fifth of all scenarios; what needs three genes is rare."""
    if scenario["dog-1.velocity"] > 0.8:
        return result("common")
    keys = ("environment.rain", "environment.fog")
    low = [scenario[key] / 0.15 for key in keys] + [scenario["environment.sun_position"]]
    far = max(low)
    if far < 0.1:
        return result("rare")
    return result("", "rare" if far < 0.4 else "", 3 * far)


def search(method: Any, generations: int) -> Counter[str]:
    found: Counter[str] = Counter()
    for _ in range(generations):
        flown = [FlownScenario(scenario=s, result=common_and_rare(s)) for s in method.ask()]
        method.tell(flown)
        found.update(item.result.signature for item in flown)
    return found


def test_near_misses_lead_to_a_rare_way_to_fail() -> None:
    found, by_chance = search(Garl(PLAN), 40), search(RandomSearch(PLAN), 40)
    assert by_chance["rare"] <= 1
    assert found["rare"] >= 5
    assert found["common"] >= by_chance["common"] / 2


def test_unknown_cells_are_chosen_equally_often() -> None:
    search_ = Garl(PLAN)
    first = search_.ask()
    cells = ["a"] * 17 + ["b", "c", ""]
    near = [result("", cell) for cell in cells]
    search_.tell([FlownScenario(scenario=s, result=r) for s, r in zip(first, near, strict=True)])
    seeds = {scenario.seed: cell for scenario, cell in zip(first, cells, strict=True)}
    bred: Counter[str] = Counter()
    for _ in range(30):
        bred.update(seeds[each.seed] for each in search_.ask() if each.seed in seeds)
    share = 30 * 20 * (1 - GarlParameters().explore_share) / 4
    for cell in ("a", "b", "c", ""):
        assert 0.7 * share < bred[cell] < 1.3 * share


def test_a_successful_cell_is_chosen_more_often() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=0.0, crossover_probability=0.0))
    lines: dict[int, str] = {}
    bred: Counter[str] = Counter()
    for _ in range(5):
        flown = []
        for index, scenario in enumerate(method.ask()):
            line = lines.setdefault(scenario.seed, "ab"[index % 2])
            # The line of b comes nearer with every child, that of a never does.
            far = 2.9 if line == "a" else 2.9 - 0.035 * bred["b"]
            flown.append(FlownScenario(scenario=scenario, result=result("", line, far)))
            bred[line] += 1
        method.tell(flown)
    # Ten of each were there at first.
    assert bred["b"] - 10 > 3 * (bred["a"] - 10) > 0


def test_the_first_violation_of_a_kind_is_worth_more_than_the_fourth() -> None:
    method = Garl(PLAN)
    items = [FlownScenario(scenario=each, result=result("IV:dog")) for each in method.ask()]
    assert [method._success("IV:dog", item) for item in items[:4]] == [1.0, 0.5**0.5, 3**-0.5, 0.5]


def test_a_cell_is_named_by_signature_near_miss_or_outcome() -> None:
    assert cell_of(result("IV:dog:descent:seen", "IV:person:take-off:seen")) == (
        "IV:dog:descent:seen"
    )
    assert cell_of(result("", "IV:person:take-off:seen")) == "IV:person:take-off:seen"
    assert cell_of(result("")) == "landed"


def genes(scenarios: Iterable[Scenario]) -> NDArray[np.float64]:
    """Return normalised chromosomes, one a row."""
    genome = PLAN.genome
    return np.array([genome.normalise(encode(each, genome)) for each in scenarios])


WEATHER = np.array([key.startswith("environment.") for key in PLAN.genome.keys])


def test_places_and_speeds_are_spread_out_and_weather_is_not() -> None:
    spread, plain = Garl(PLAN), Garl(PLAN, GarlParameters(spread_share=0.0))
    found, by_chance = (
        genes(each for _ in range(10) for each in method.ask()) for method in (spread, plain)
    )
    assert mean_distance(found) > 1.2 * mean_distance(by_chance)
    at_an_end = (found < 0.02) | (found > 0.98)
    assert at_an_end[:, WEATHER].mean() < 0.06
    # Away from all that was asked for means at both ends alike.
    speeds = found[:, [key.endswith(".velocity") for key in PLAN.genome.keys]]
    assert 0.4 < speeds.mean() < 0.6


def test_markers_are_put_far_from_each_other() -> None:
    marker = np.array([key.startswith("marker.") for key in PLAN.genome.keys])

    def apart(method: Garl) -> float:
        """Return how far the nearest other marker is, on average."""
        places = genes(each for _ in range(10) for each in method.ask())[:, marker]
        every = np.linalg.norm(places[:, None] - places[None, :], axis=2)
        np.fill_diagonal(every, np.inf)
        return float(every.min(axis=1).mean())

    assert apart(Garl(PLAN)) > 1.2 * apart(Garl(PLAN, GarlParameters(spread_share=0.0)))


def test_a_far_child_keeps_the_weather_and_the_npc_that_was_hit() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=0.0))
    first = method.ask()[:1]
    near_miss = dataclasses.replace(result("IV:dog"), closest_body="dog-1")
    method.tell([FlownScenario(scenario=each, result=near_miss) for each in first])
    (parent,) = genes(first)
    kept = WEATHER | np.array([key.startswith("dog-1.") for key in PLAN.genome.keys])
    children = genes(method._child("IV:dog", FAR) for _ in range(50))
    assert np.abs(children - parent)[:, kept].max() < 1e-9
    assert np.abs(children - parent)[:, ~kept].mean() > 0.2


def test_only_violations_are_bred_far() -> None:
    method = Garl(PLAN)
    results = [result("", "near")] * 10 + [result("hit")] * 10
    method.tell(
        [FlownScenario(scenario=s, result=r) for s, r in zip(method.ask(), results, strict=True)]
    )
    chosen = {method._choose() for _ in range(200)}
    assert chosen == {("near", NEAR), ("hit", NEAR), ("hit", FAR)}


def test_a_search_with_one_cell_breeds_from_it() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=0.0, cell=lambda result: ""))
    first = method.ask()
    method.tell([FlownScenario(scenario=each, result=result("", "near")) for each in first])
    seeds = {each.seed for each in first}
    assert all(child.seed in seeds for child in method.ask())
