"""The surrogate of curious and chasing NPCs."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env

from pytest_garl.npcs.decision_rules import Intercepting
from pytest_garl.npcs.training.episode import draw_episode
from pytest_garl.npcs.training.graded_landing import LATEST_COMING_S, with_story
from pytest_garl.npcs.training.presets import PRESETS
from pytest_garl.npcs.training.surrogate import (
    GradedEnv,
    env_of,
)
from pytest_garl.scenarios.story import LIMITS_S, story_of
from tests.npcs.training.surrogates import COURT, OURS

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


@pytest.mark.parametrize("kind", ["person", "child", "dog", "bird"])
def test_each_npc_of_the_surrogate_has_the_drawn_story(kind: str) -> None:
    scenario, place = draw_episode(COURT[0], [kind], np.random.default_rng(0))
    told = with_story(scenario, place, "chasing", 8.0, np.random.default_rng(1))
    story = story_of(told, f"{kind}-1")
    assert story is not None
    assert story.grade == "chasing"
    assert 0 < story.delay_s <= LATEST_COMING_S
    assert 0 < story.lasts_s <= LIMITS_S["chasing"]
    assert not story.is_child, "its body is that of its type"
