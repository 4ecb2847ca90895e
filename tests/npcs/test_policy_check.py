from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.policy_catalogue import policy_names, policy_spec
from pytest_garl.npcs.policy_check import check_policy
from pytest_garl.simulation.npc_policy import Move, PolicySpec, Situation
from tests.support.situations import MAP


@pytest.mark.parametrize("name", policy_names())
def test_every_shipped_policy_passes_the_check(name: str) -> None:
    check_policy(policy_spec(name), MAP)


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
            "wind": Move(x=0.0, y=0.0, changes=(("wind.mean_mps", 0.1),)),
            "fog": Move(x=0.0, y=0.0, changes=(("environment.fog", math.nan),)),
            "bare": Move(x=0.0, y=0.0, changes=bare),
        }
        move: Move = answers[self._answer]
        return move


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (
            "far",
            r"deciding for person-1: found Move\(x=1.0, y=1.0, .*begins=False\); expected",
        ),
        ("nan", "found Move"),
        ("number", "found 7; expected Move"),
        ("words", "found Move"),
        ("missing", "raised KeyError"),
        (
            "wind",
            r"found the change \('wind.mean_mps', 0.1\); expected \(gene, number\) with",
        ),
        ("fog", r"found the change \('environment.fog', nan\)"),
        ("bare", "found the change 'environment.fog'"),
    ],
)
def test_an_invalid_move_is_refused_before_any_flight(answer: str, words: str) -> None:
    spec = PolicySpec(name="wild", factory=f"{__name__}:Wild", arguments=(("answer", answer),))
    with pytest.raises(PolicyError, match=words):
        check_policy(spec, MAP)


def test_a_policy_with_wrong_arguments_is_refused() -> None:
    spec = PolicySpec(name="wild", factory=f"{__name__}:Wild", arguments=(("colour", "red"),))
    with pytest.raises(PolicyError, match=r"'wild': .*raised TypeError"):
        check_policy(spec, MAP)
