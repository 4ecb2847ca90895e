from __future__ import annotations

import types
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.methods.random import RandomSearch
from tests.support.results import flight_result

LAWN = load_map("lawn")
PLAN = SearchPlan(map=LAWN, genome=genome_for(LAWN), seed=0, flights=8, population=2)


class Own(RandomSearch):
    """A user's own method; the tests below break one of its parts."""


@pytest.fixture
def own(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    module = types.ModuleType("my_method")
    module.make = Own  # type: ignore[attr-defined]
    monkeypatch.setitem(__import__("sys").modules, "my_method", module)
    return module


def test_a_users_method_proposes_its_scenarios(own: types.ModuleType) -> None:
    ours, shipped = make_method("my_method:make", PLAN), make_method("random", PLAN)
    assert ours.ask() == shipped.ask()
    assert ours.learns is False


def test_a_factory_without_a_method_is_an_error(own: types.ModuleType) -> None:
    own.make = lambda plan: 3  # type: ignore[attr-defined]
    with pytest.raises(GarlError, match="'my_method:make': the factory returned 3, expected a"):
        make_method("my_method:make", PLAN)


def test_an_error_in_a_users_method_is_reported_with_its_place(own: types.ModuleType) -> None:
    def broken(plan: SearchPlan) -> Any:
        raise ZeroDivisionError("no seed")

    own.make = broken  # type: ignore[attr-defined]
    expected = r"the factory raised ZeroDivisionError: no seed \(test_user_method.py:\d+\)"
    with pytest.raises(GarlError, match=expected):
        make_method("my_method:make", PLAN)


@pytest.mark.parametrize("nonsense", [None, 7, [], ["a", "b"]])
def test_a_generation_without_scenarios_is_refused(
    own: types.ModuleType, monkeypatch: pytest.MonkeyPatch, nonsense: object
) -> None:
    monkeypatch.setattr(Own, "ask", lambda self: nonsense, raising=False)
    with pytest.raises(GarlError, match=r"ask\(\) returned .*, expected a list of 2 pytest_garl"):
        make_method("my_method:make", PLAN).ask()


@pytest.mark.parametrize("nonsense", [None, [], [(0.0,)], [(0.0,), (float("nan"),)], ["ab", "cd"]])
def test_objectives_other_than_numbers_are_refused(
    own: types.ModuleType, monkeypatch: pytest.MonkeyPatch, nonsense: object
) -> None:
    monkeypatch.setattr(Own, "tell", lambda self, flown: nonsense, raising=False)
    method = make_method("my_method:make", PLAN)
    flown = [FlownScenario(scenario=each, result=flight_result()) for each in method.ask()]
    with pytest.raises(GarlError, match=r"tell\(\) returned .*, expected a list of 2 tuples"):
        method.tell(flown)
