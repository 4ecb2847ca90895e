from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import (
    EXCUSED,
    FAR,
    NEAR,
    Garl,
    GarlParameters,
    cell_of,
    cells_of,
)
from pytest_garl.search.methods.random import RandomSearch
from pytest_garl.verdicts.paper_metrics import mean_distance
from pytest_garl.verdicts.verdict import Excuse, Finding, Margin, MarginName
from tests.support.results import flight_result

MAP = load_map("court")
PLAN = SearchPlan(map=MAP, genome=genome_for(MAP), seed=0, population=20)


def result(signature: str, closest_call: str = "", distance_m: float = 0.0) -> FlightResult:
    margin = Margin(property="collision", value=distance_m, unit="m")
    return flight_result(signature, closest_call=closest_call, margins=(margin,))


def given_up(excuse: Excuse, closest_call: str = "") -> FlightResult:
    margins = (
        Margin(property="distance", value=-4.0, unit="m", decided=False),
        Margin(property="collision", value=0.3, unit="m"),
    )
    return flight_result(
        outcome="gave_up", closest_call=closest_call, margins=margins, excuse=excuse
    )


def finding(signature: str) -> Finding:
    return Finding(signature=signature, margin=-1.0, unit="m", time_s=9.0, story="A story.")


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


def test_nothing_is_bred_from_flights_in_which_nobody_could_have_seen_the_marker() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=0.0))
    first = method.ask()
    results = [given_up("undetectable")] * 19 + [given_up("blocked")]
    method.tell([FlownScenario(scenario=s, result=r) for s, r in zip(first, results, strict=True)])
    assert {method._choose() for _ in range(50)} == {("blocked", NEAR)}
    # The tail of a chromosome, and so the seed, may come from a second parent.
    assert {each.seed for _ in range(5) for each in method.ask()} == {first[-1].seed}


def test_the_search_leaves_weather_in_which_nobody_could_have_landed() -> None:
    def flown_in(scenario: Scenario) -> FlightResult:
        if scenario["environment.fog"] > 0.075:
            return given_up("undetectable", "IV:dog:descent:seen")
        return common_and_rare(scenario)

    def share(method: Any) -> float:
        excused = 0
        for _ in range(10):
            flown = [FlownScenario(scenario=s, result=flown_in(s)) for s in method.ask()]
            method.tell(flown)
            excused += sum(item.result.verdict.no_landing == EXCUSED for item in flown)
        return excused / 200

    by_chance = share(RandomSearch(PLAN))
    assert 0.4 < by_chance < 0.6
    assert share(Garl(PLAN)) < by_chance / 2


def test_a_search_in_which_nobody_can_see_the_marker_draws_at_random() -> None:
    method, by_chance = Garl(PLAN), Garl(PLAN)
    method.tell(
        [FlownScenario(scenario=each, result=given_up("undetectable")) for each in method.ask()]
    )
    by_chance.ask()
    assert method.ask() == by_chance.ask()


def test_other_weather_is_that_of_a_flight_that_landed_or_failed() -> None:
    method = Garl(PLAN)
    first = method.ask()
    results = [given_up("blocked")] * 9 + [given_up("undetectable")] * 10 + [result("")]
    method.tell([FlownScenario(scenario=s, result=r) for s, r in zip(first, results, strict=True)])
    assert {method._in_other_weather() for _ in range(50)} == {first[-1]}


def test_a_needless_end_without_landing_is_bred_like_any_violation() -> None:
    needless = flight_result("II:lost:descent", outcome="gave_up", primary="time")
    assert cell_of(needless) == "II:lost:descent"
    method = Garl(PLAN)
    method.tell([FlownScenario(scenario=each, result=needless) for each in method.ask()])
    assert {method._choose()[1] for _ in range(50)} == {NEAR, FAR}


def test_a_child_of_a_violation_without_contact_does_not_aim_at_a_body() -> None:
    method = Garl(PLAN, GarlParameters(aimed_share=1.0, crossover_probability=0.0))
    first = method.ask()[:1]
    lost = flight_result("II:lost:descent", outcome="gave_up", primary="time", closest_body="dog-1")
    method.tell([FlownScenario(scenario=each, result=lost) for each in first])
    (parent,) = genes(first)
    children = genes(method._child("II:lost:descent", NEAR) for _ in range(30))
    dog = np.array([key.startswith("dog-1.") for key in PLAN.genome.keys])
    assert np.abs(children - parent)[:, ~dog].max() > 0.01


def test_what_had_gone_wrong_before_is_a_cell_of_its_own_and_worth_half_a_violation() -> None:
    method = Garl(PLAN, GarlParameters(explore_share=0.0))
    before = finding("off:descending-elsewhere")
    hit = flight_result("IV:bird", findings=(before,))
    landed = flight_result(findings=(before,))
    assert cells_of(hit) == ("IV:bird", "off:descending-elsewhere")
    items = [FlownScenario(scenario=each, result=hit) for each in method.ask()]
    # Each is the n-th violation of its kind and the n-th finding.
    assert [method._success("IV:bird", item) for item in items[:2]] == [1.0, 0.5**0.5]
    third = FlownScenario(scenario=items[2].scenario, result=landed)
    assert method._success("landed", third) == 1.0
    method.tell(items)
    chosen = {method._choose() for _ in range(200)}
    assert chosen == {
        ("IV:bird", NEAR),
        ("IV:bird", FAR),
        ("off:descending-elsewhere", NEAR),
    }


@pytest.mark.parametrize(
    ("margins", "name"),
    [
        ({"collision": 1.0, "decoy": 1.4}, "IV:person:take-off:seen"),
        ({"collision": 2.9, "decoy": 0.2}, "near decoy"),
        ({"collision": 2.9, "dropout": -1.0}, "near dropout"),
        ({"collision": 9.0, "time": 90.0, "distance": 0.7, "slide": 0.5}, "landed"),
    ],
)
def test_a_near_miss_is_named_by_what_was_nearest(
    margins: dict[MarginName, float], name: str
) -> None:
    close = "IV:person:take-off:seen" if margins["collision"] < 3 else ""
    found = tuple(Margin(property=key, value=value, unit="m") for key, value in margins.items())
    assert cell_of(flight_result(closest_call=close, margins=found)) == name


def test_a_flight_without_landing_that_is_excused_is_named_by_its_cause() -> None:
    assert cell_of(given_up("blocked", "IV:person:descent:seen")) == "blocked"
    assert cell_of(given_up("undetectable", "IV:person:descent:seen")) == EXCUSED


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
    method = Garl(PLAN, GarlParameters(explore_share=0.0, cells=lambda result: ("",)))
    first = method.ask()
    method.tell([FlownScenario(scenario=each, result=result("", "near")) for each in first])
    seeds = {each.seed for each in first}
    assert all(child.seed in seeds for child in method.ask())
