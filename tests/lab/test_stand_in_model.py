"""The stand-in as the model of itself: right, or off by a share."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from lab.ablations import ALMOST_RIGHT, make
from lab.arms import DOMAIN
from lab.stand_in import stand_in
from lab.stand_in_model import StandInModel, perturbed
from lab.stand_in_way import ORDINARY
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search import evolution
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import FlownScenario, SearchPlan, TellsOrigins
from pytest_garl.search.methods.random import random_scenarios
from pytest_garl.search.model import proximities

MAP = load_map("court")
PLAN = SearchPlan(map=MAP, genome=genome_of(DOMAIN, MAP), seed=200, population=4)
SCENARIOS = random_scenarios(MAP, PLAN.genome, 200, 0, 30)


def results(share: float) -> list[FlightResult]:
    copy = perturbed(share, 7)
    return [copy(each, MAP, ORDINARY) for each in SCENARIOS]


def test_a_copy_is_off_by_its_share() -> None:
    flown = [stand_in(each, MAP, ORDINARY) for each in SCENARIOS]
    assert results(0.0) == flown
    off = results(0.3)
    assert off == results(0.3)
    near = np.array([[proximities(each) for each in own] for own in (flown, off)])
    assert 0.01 < float(np.abs(near[0] - near[1]).mean()) < 0.5


def test_the_right_model_predicts_what_the_stand_in_does() -> None:
    rng = np.random.default_rng(1)
    rows = np.array([PLAN.genome.random(rng) for _ in range(6)])
    model = StandInModel(
        PLAN,
        perturbed(0.0, 0),
        ORDINARY,
        Columns(PLAN.genome),
        rows,
        np.zeros((6, 9)),
        np.zeros(6),
        np.zeros(6),
    )
    told = model.predict(rows)
    assert told.proximity.shape[0] == 6
    assert set(told.fails.tolist()) <= {0.0, 1.0}
    assert (told.rarity == told.fails).all()


def test_a_search_breeds_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolution, "POPULATION", 10)
    monkeypatch.setattr(evolution, "GENERATIONS", 1)
    method = make(ALMOST_RIGHT, PLAN, ORDINARY)
    fly = functools.partial(stand_in, map=MAP, landing=ORDINARY)
    flown = [FlownScenario(scenario=each, result=fly(each)) for each in method.ask()]
    method.tell(flown)
    assert len(method.ask()) == 4
    assert isinstance(method, TellsOrigins)
    assert "bred" in {each.how for each in method.origins}
