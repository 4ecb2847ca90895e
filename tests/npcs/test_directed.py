"""The director lets an NPC go in flight, and a scenario with its decision flies the same."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.flight.flight import Flight
from pytest_garl.npcs import directed
from pytest_garl.npcs.director import FEATURES, Features, LearnedDirector, TimeToGo
from pytest_garl.npcs.learned import Network, learned_director
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import STORY_MOMENTS, story_of, waits_for_decision
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.landing_moments import decided_genes
from tests.support.flights import Scripted
from tests.support.stories import EMPTY, scenario_with, walk

DECIDED = float(STORY_MOMENTS.index("decided"))
GRADED = policy_spec("graded")


class GoesAfter:
    """Lets everyone go at the decision with a number."""

    def __init__(self, number: int) -> None:
        self.left = number

    def decides(self, features: Features) -> bool:
        self.left -= 1
        return self.left < 0


class Waits(Scripted):
    def step(self, observation: object) -> object:
        return self.hover(2.0)


def waiting(name: str, grade: float, speed: float = 3.0, **values: float) -> Scenario:
    told = {"grade": grade, "phase": DECIDED, "lasts_s": 5.0, "delay_s": 7.0, **values}
    return scenario_with(name, (-8.0, 3.0), speed, told)


def flown(scenario: Scenario, policy: str = "graded") -> Flight:
    return fly(scenario, Waits, policy_spec(policy), map=EMPTY, time_limit_s=14.0)


def test_an_npc_comes_when_the_director_lets_it_go(monkeypatch: pytest.MonkeyPatch) -> None:
    director = GoesAfter(6)
    monkeypatch.setattr(directed, "director_of", lambda text: director)
    places = walk(waiting("person-1", 2.0), "person-1", seconds=8)
    first = int((np.abs(places[:, 0] + 8.0) > 0.01).argmax()) / 60
    assert 3.0 < first < 3.5
    director.left = 10**6
    assert np.ptp(walk(waiting("person-1", 2.0), "person-1", seconds=8)[:, 0]) == 0


@pytest.mark.sim
@pytest.mark.parametrize(("name", "speed"), [("person-1", 2.0), ("dog-1", 5.0), ("bird-1", 9.0)])
def test_a_scenario_with_the_decision_flies_the_same(
    name: str, speed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    director = GoesAfter(7)
    monkeypatch.setattr(directed, "director_of", lambda text: director)
    scenario = waiting(name, 2.0, speed)
    live = flown(scenario)
    genes = dict(decided_genes(scenario, live, GRADED))
    again = scenario.replace(genes)
    story = story_of(again, name)
    assert story is not None
    assert not waits_for_decision(story)
    assert story.delay_s <= 3.5
    monkeypatch.setattr(directed, "director_of", lambda text: pytest.fail("asked"))
    assert flown(again).sha256 == live.sha256


@pytest.mark.sim
def test_an_npc_that_is_never_let_go_repeats_as_one_that_comes_too_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(directed, "director_of", lambda text: GoesAfter(10**6))
    scenario = waiting("person-1", 1.0)
    live = flown(scenario)
    again = scenario.replace(dict(decided_genes(scenario, live, GRADED)))
    assert flown(again).sha256 == live.sha256


@pytest.mark.sim
@pytest.mark.parametrize("policy", ["graded", "stand", "careless"])
def test_who_decides_nothing_comes_just_in_time(policy: str) -> None:
    scenario = waiting("bird-1", 0.0 if policy == "graded" else 2.0, 9.0)
    live = flown(scenario, policy)
    again = scenario.replace(dict(decided_genes(scenario, live, policy_spec(policy))))
    story = story_of(again, "bird-1")
    assert story is not None
    assert STORY_MOMENTS[story.phase] == "met"
    assert flown(again, policy).sha256 == live.sha256


def test_the_shipped_director_is_asked_unless_a_text_names_another() -> None:
    director = directed.director_of("")
    assert director is directed.director_of("")
    assert isinstance(director, LearnedDirector)
    assert directed.director_of("time-to-go 0.5 1") == TimeToGo(margin_s=0.5, unseen_s=1.0)


def test_weights_in_a_text_decide_like_those_that_ship() -> None:
    shipped = learned_director().network
    assert isinstance(shipped, Network)
    again = directed.director_of(shipped.text)
    assert isinstance(again, LearnedDirector)
    for state in np.random.default_rng(3).uniform(-1, 1, (20, len(FEATURES))):
        assert np.array_equal(again.network.values(state), shipped.values(state))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time-to-go soon", "expected 'time-to-go MARGIN_S UNSEEN_S', two numbers"),
        ("26,2:AAAA", "expected the sizes of its layers and its weights"),
        ("weights", "expected the sizes of its layers and its weights"),
        (f"3,2:{base64.b64encode(bytes(32)).decode()}", f"but {len(FEATURES)} inputs"),
    ],
)
def test_a_text_that_names_no_director_is_an_error(text: str, message: str) -> None:
    with pytest.raises(PolicyError, match=re.escape(message)):
        directed.director_of(text)


@pytest.mark.parametrize("policy", ["graded", "curious", "chasing"])
def test_a_policy_takes_the_director_that_it_is_given(policy: str) -> None:
    spec = policy_spec(policy)
    assert spec.directed_by("") is spec
    directed_by = spec.directed_by("time-to-go 0 0")
    assert dict(directed_by.arguments) == {"director": "time-to-go 0 0"}
    directed_by.make()
    assert policy_spec("stand").directed_by("time-to-go 0 0") == policy_spec("stand")
