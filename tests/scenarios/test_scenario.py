"""Equal scenarios are equal values, whatever they were made from."""

from __future__ import annotations

import itertools

import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.scenario import Scenario

BARE = Scenario(map="court", seed=1, genes=(("marker.x", 0.25), ("environment.fog", 0.5)))
CONDITIONS = {"wind.mean_mps": 3.0, "told.error_m": 1.0, "light.turn_deg": 20.0}


def test_conditions_have_one_order_however_they_are_set() -> None:
    orders = {
        BARE.replace(dict(pairs)).genes for pairs in itertools.permutations(CONDITIONS.items())
    }
    one_by_one = BARE
    for key, value in CONDITIONS.items():
        one_by_one = one_by_one.replace({key: value})
    assert orders == {one_by_one.genes}
    keys = [key for key, _ in one_by_one.genes]
    assert keys[:2] == ["marker.x", "environment.fog"]
    assert keys[2:] == [key for key in QUANTITIES if key in CONDITIONS]


def test_a_condition_that_is_set_back_to_nominal_is_no_longer_named() -> None:
    windy = BARE.replace(CONDITIONS)
    back = windy.replace({key: QUANTITIES[key].nominal for key in CONDITIONS})
    assert back == BARE
    assert hash(back) == hash(BARE)
    named = Scenario(map="court", seed=1, genes=(("wind.mean_mps", 0.0), *BARE.genes))
    assert named.replace({}) == BARE


def test_a_value_that_is_neither_there_nor_a_condition_cannot_be_replaced() -> None:
    with pytest.raises(ScenarioError, match=r"no gene 'environment\.mist'"):
        BARE.replace({"environment.mist": 0.1})
