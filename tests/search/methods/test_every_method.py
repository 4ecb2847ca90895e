"""Tests of all shipped methods."""

from __future__ import annotations

import pytest

from pytest_garl.scenarios.validity import problems
from pytest_garl.search.method_catalogue import make_method
from tests.search.searches import MAP, bred, every_method, plan


@pytest.mark.parametrize("name", every_method())
def test_a_method_depends_on_its_plan_and_results_alone(name: str) -> None:
    first, again = (bred(make_method(name, plan()), 6) for _ in range(2))
    assert first == again
    assert bred(make_method(name, plan(seed=1)), 1) != first[:1]


@pytest.mark.parametrize("name", every_method())
def test_a_method_says_whether_it_learns_and_overlaps(name: str) -> None:
    method = make_method(name, plan())
    assert {type(method.learns), type(method.overlaps)} == {bool}


@pytest.mark.parametrize("name", every_method())
def test_every_scenario_is_valid_and_new(name: str) -> None:
    scenarios = [each for made in bred(make_method(name, plan()), 12) for each in made]
    assert not [found for each in scenarios for found in problems(each, MAP)]
    assert len({each.genes for each in scenarios}) == len(scenarios) == 96


@pytest.mark.parametrize("name", ["garl", "garl-paper", "ga"])
@pytest.mark.parametrize("population", [1, 2, 3, 20])
def test_every_generation_has_the_size_of_the_population(name: str, population: int) -> None:
    made = bred(make_method(name, plan(population=population)), 4)
    assert [len(generation) for generation in made] == [population] * 4
