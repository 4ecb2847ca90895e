from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from pytest_garl.adversary.scripted import LEARNED, POLICIES, check_policy, policy_spec
from pytest_garl.errors import PolicyError
from pytest_garl.simulation.npc_policy import DECISION_STEP_S, Move, PolicySpec, Situation
from tests.adversary.situations import MAP, being, situation


def walk(name: str, start: tuple[float, float], decisions: int) -> list[tuple[float, float]]:
    """Walk without inertia around a marker at (3, 1)."""
    policy = policy_spec(name).make()
    place, path = start, [start]
    policy.reset(situation(being(place), marker=(3, 1)), np.random.default_rng(0))
    for _ in range(decisions):
        me = being(place)
        move = policy.decide(situation(me, marker=(3, 1)))
        step = me.speed_mps * DECISION_STEP_S
        place = (place[0] + step * move.x, place[1] + step * move.y)
        path.append(place)
    return path


def test_greedy_walks_across_the_marker_again_and_again() -> None:
    path = walk("greedy", (-4.0, 1.0), 40)
    sides = [math.copysign(1, x - 3) for x, _ in path if abs(x - 3) > 0.4]
    assert sum(a != b for a, b in itertools.pairwise(sides)) >= 5
    steps = [math.dist(a, b) for a, b in itertools.pairwise(path)]
    assert min(steps) == pytest.approx(1.0)


def test_stand_walks_to_the_marker_and_stays() -> None:
    path = walk("stand", (-4.3, 2.0), 12)
    assert math.dist(path[-1], (3, 1)) < 1e-6


@pytest.mark.parametrize("name", [*POLICIES, *LEARNED])
def test_every_shipped_policy_passes_the_check(name: str) -> None:
    check_policy(policy_spec(name), MAP)


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(PolicyError, match=r"'gredy'.*dqn.*greedy.*\.npz"):
        policy_spec("gredy")


class Wild:
    def __init__(self, answer: str) -> None:
        self._answer = answer

    def reset(self, situation: Situation, rng: np.random.Generator) -> None: ...

    def decide(self, situation: Situation) -> Move:
        words: Any = "up"
        bare: Any = ("environment.fog", 0.1)
        answers: dict[str, Any] = {
            "far": Move(x=1.0, y=1.0),
            "nan": Move(x=math.nan, y=0.0),
            "words": Move(x=words, y=0.0),
            "number": 7,
            "wind": Move(x=0.0, y=0.0, changes=(("wind.x", 0.1),)),
            "fog": Move(x=0.0, y=0.0, changes=(("environment.fog", math.nan),)),
            "bare": Move(x=0.0, y=0.0, changes=bare),
        }
        move: Move = answers[self._answer]
        return move


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("far", r"deciding for person-1: found Move\(x=1.0, y=1.0, changes=\(\)\); expected"),
        ("nan", "found Move"),
        ("number", "found 7; expected Move"),
        ("words", "found Move"),
        ("missing", "raised KeyError"),
        ("wind", r"found the change \('wind.x', 0.1\); expected \(gene, number\) with one of env"),
        ("fog", r"found the change \('environment.fog', nan\)"),
        ("bare", "found the change 'environment.fog'"),
    ],
)
def test_a_policy_that_answers_nonsense_is_refused_before_any_flight(
    answer: str, words: str
) -> None:
    spec = PolicySpec(name="wild", factory=f"{__name__}:Wild", arguments=(("answer", answer),))
    with pytest.raises(PolicyError, match=words):
        check_policy(spec, MAP)


def test_a_policy_that_cannot_be_made_is_refused() -> None:
    spec = PolicySpec(name="wild", factory=f"{__name__}:Wild", arguments=(("colour", "red"),))
    with pytest.raises(PolicyError, match=r"'wild': .*raised TypeError"):
        check_policy(spec, MAP)
