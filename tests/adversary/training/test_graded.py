"""The surrogate of curious and chasing NPCs."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env

from pytest_garl.adversary.minds import Intercepting
from pytest_garl.adversary.training.graded import GradedEnv, env_of
from pytest_garl.adversary.training.presets import PRESETS
from tests.adversary.training.surrogates import COURT, OURS

CURIOUS, CHASING = (
    dataclasses.replace(PRESETS[name].surrogate, maps=COURT) for name in ("curious", "chasing")
)


def fly(env: GradedEnv, seed: int) -> list[Any]:
    """Fly an episode with random actions."""
    rng = np.random.default_rng(seed)
    state, _ = env.reset(seed=seed)
    steps: list[Any] = [state.tolist()]
    over = False
    while not over:
        state, reward, over, _, info = env.step(np.int64(rng.integers(5)))
        steps.append((state.tolist(), reward, info))
    return steps


@pytest.mark.sim
@pytest.mark.parametrize("surrogate", [CURIOUS, CHASING], ids=["curious", "chasing"])
def test_gymnasium_finds_nothing_wrong(surrogate: Any) -> None:
    check_env(GradedEnv(surrogate), skip_render_check=True)


@pytest.mark.sim
def test_a_seed_repeats_its_episode_and_others_differ() -> None:
    env = GradedEnv(CHASING)
    first, again, other = fly(env, 1), fly(env, 1), fly(env, 2)
    env.close()
    assert first == again != other


@pytest.mark.sim
def test_an_npc_that_goes_to_the_uav_hits_one_that_does_not_avoid() -> None:
    env = GradedEnv(dataclasses.replace(CHASING, uav="straight"))
    hits = 0
    for seed in range(12):
        _, info = env.reset(seed=seed)
        over = False
        while not over and env.belief is not None:
            _, _, over, _, info = env.follow(Intercepting().decide(env.belief))
        hits += bool(info["collided"])
    env.close()
    assert 1 <= hits < 12


@pytest.mark.sim
def test_a_step_after_the_end_changes_nothing() -> None:
    env = GradedEnv(CURIOUS)
    fly(env, 3)
    assert env.step(np.int64(0))[1:4] == (0.0, True, False)
    env.close()


def test_a_surrogate_with_grades_has_their_environment() -> None:
    assert isinstance(env_of(CHASING), GradedEnv)
    assert not isinstance(env_of(OURS), GradedEnv)
