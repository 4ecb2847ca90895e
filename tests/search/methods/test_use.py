"""The method that draws from a model of use: its parts, its strata, and its placebo."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.genes import CLEAR
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import parse_use, use_text
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.use import LEARNED_FROM, REGION_SHARE, Use
from tests.search.searches import result

MAP = load_map("lawn")
GENOME = genome_of(domain_named("field"), MAP)
PLAN = SearchPlan(
    map=MAP,
    genome=GENOME,
    seed=4,
    flights=400,
    population=20,
    use=parse_use(use_text("field", [(GENOME, MAP)]), "use.toml"),
)


def flown(made: list[Scenario]) -> list[FlownScenario]:
    """Fog and a fast dog make it fail."""
    return [FlownScenario(scenario=each, result=result(_with_dog(each))) for each in made]


def _with_dog(scenario: Scenario) -> Scenario:
    genes = dict(scenario.genes) | {"dog-1.velocity": scenario.get("dog-1.velocity", 0.0)}
    return dataclasses.replace(scenario, genes=tuple(genes.items()))


def run(
    plan: SearchPlan, generations: int, *, late: int = 0
) -> tuple[list[list[Scenario]], list[list[str]]]:
    """Return scenarios and origins; each generation is told ``late`` generations later."""
    method = Use(plan)
    made: list[list[Scenario]] = []
    hows: list[list[str]] = []
    for number in range(generations):
        if number - 1 - late >= 0:
            method.tell(flown(made[number - 1 - late]))
        made.append(list(method.ask()))
        hows.append([each.how for each in method.origins])
    return made, hows


def test_the_first_flights_are_plain_draws_and_later_ones_half_in_the_region() -> None:
    _, hows = run(PLAN, 8)
    plain = LEARNED_FROM // 20 + 1
    assert {how for each in hows[:plain] for how in each} == {"use"}
    for each in hows[plain:]:
        assert (each.count("inside"), each.count("outside")) == (10, 10)


def test_scenarios_do_not_depend_on_how_early_results_are_told() -> None:
    assert run(PLAN, 7) == run(PLAN, 7, late=1)


def test_the_region_holds_more_failures_than_the_rest() -> None:
    made, hows = run(PLAN, 12)
    fails = {"inside": 0, "outside": 0}
    for scenarios, own in zip(made[6:], hows[6:], strict=True):
        for how, each in zip(own, flown(scenarios), strict=True):
            fails[how] += each.result.verdict.violation
    assert fails["inside"] > 3 * max(1, fails["outside"])


def test_shares_of_the_strata_are_noted_and_together_all_of_use() -> None:
    method = Use(PLAN)
    for _ in range(6):
        method.tell(flown(list(method.ask())))
        assert {each.share for each in method.origins} == {1.0}
    method.ask()
    shares = {each.how: each.share or 0.0 for each in method.origins}
    assert shares["inside"] == pytest.approx(REGION_SHARE, abs=1e-3)
    assert shares["inside"] + shares["outside"] == pytest.approx(1.0)


def test_an_archive_that_knows_enough_chooses_the_region_before_the_second_generation() -> None:
    known, _ = run(PLAN, 5)
    archive = tuple(item for each in known for item in flown(each))
    plan = dataclasses.replace(PLAN, seed=5, known=archive)
    made, hows = run(plan, 2)
    assert set(hows[0]) == {"use"}
    assert set(hows[1]) == {"inside", "outside"}
    assert made[0] == run(dataclasses.replace(plan, known=archive[:50]), 1)[0][0]


def test_all_landing_systems_get_the_same_plain_draws() -> None:
    first, second = Use(PLAN), Use(PLAN)
    for _ in range(3):
        made = list(first.ask())
        assert made == list(second.ask())
        first.tell(flown(made))
        second.tell([FlownScenario(scenario=e, result=result(_with_dog(made[0]))) for e in made])


def test_use_in_which_nothing_occurs_is_drawn_without_any_condition() -> None:
    kinds = dict(MAP.all_objects)
    sections = {kinds.get(each.name, each.name) for each in GENOME.genes if each.is_optional}
    text = "".join(f"[{each}]\nshare = 0\n" for each in sorted(sections))
    made, _ = run(dataclasses.replace(PLAN, use=parse_use(text, "use.toml")), 7)
    allowed = {*CLEAR, *dict(GENOME.fixed), "marker.x", "marker.y"}
    for scenario in (each for generation in made for each in generation):
        assert {*scenario.removed_objects} == {*kinds}
        assert {key for key, _ in scenario.genes} <= allowed


def test_without_a_model_of_use_the_error_says_how_to_get_one() -> None:
    with pytest.raises(GarlError, match=r"garl_use; `garl domain use` prints one"):
        make_method("use", dataclasses.replace(PLAN, use=None))
