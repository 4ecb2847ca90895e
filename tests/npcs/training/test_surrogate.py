from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env

from pytest_garl.npcs.training.presets import PRESETS, Surrogate
from pytest_garl.npcs.training.surrogate import SurrogateEnv
from tests.npcs.training.surrogates import COURT, OURS, PAPERS

ONLINE = dataclasses.replace(PRESETS["online-rl"].surrogate, maps=COURT)


def fly(env: SurrogateEnv, seed: int, action: int | None = None) -> list[Any]:
    """Fly an episode with one action all the time, or random ones."""
    rng = np.random.default_rng(seed)
    state, _ = env.reset(seed=seed)
    steps: list[Any] = [state.tolist()]
    over = False
    while not over:
        choice = int(rng.integers(5)) if action is None else action
        state, reward, ended, cut, info = env.step(np.int64(choice))
        steps.append((state.tolist(), reward, info))
        over = ended or cut
    return steps


@pytest.mark.sim
@pytest.mark.parametrize("surrogate", [OURS, PAPERS, ONLINE], ids=["ours", "paper", "online"])
def test_gymnasium_finds_nothing_wrong(surrogate: Surrogate) -> None:
    check_env(SurrogateEnv(surrogate), skip_render_check=True)


@pytest.mark.sim
def test_a_seed_repeats_its_episode_and_others_differ() -> None:
    env = SurrogateEnv(OURS)
    first, again, other = fly(env, 1), fly(env, 1), fly(env, 2)
    env.close()
    assert first == again != other


@pytest.mark.sim
def test_the_online_rival_changes_the_environment_that_it_sees() -> None:
    # A bird would fly on while its policy changes the environment.
    env = SurrogateEnv(dataclasses.replace(ONLINE, types=("person",)))
    starts = np.array([env.reset(seed=seed)[0] for seed in range(6)])
    # Weather, light and the marker's place are drawn anew for each episode.
    assert (starts[:, 4:].std(axis=0) > 0.05).all()
    state, fog_up, east = starts[-1], np.int64(7), np.int64(3)
    foggier = env.step(fog_up)[0]
    assert foggier[5] == pytest.approx(min(1.0, state[5] + 0.01 / 0.15), abs=1e-6)
    assert np.delete(foggier, [2, 3, 5]) == pytest.approx(np.delete(state, [2, 3, 5]), abs=1e-6)
    moved = env.step(east)[0]
    assert moved[4:] == pytest.approx(foggier[4:])
    assert moved[0] > foggier[0]
    env.close()


@pytest.mark.sim
def test_an_npc_in_the_column_of_a_blind_uav_collides_and_ends_the_episode() -> None:
    env = SurrogateEnv(dataclasses.replace(OURS, uav="straight", types=("person",)))
    ends = [fly(env, seed, action=3)[-1] for seed in range(6)]
    hits = [(reward, info) for _, reward, info in ends if info["collided"]]
    assert hits
    for reward, info in hits:
        assert info["outcome"] == "collision"
        assert reward > 0.9
    _, reward, ended, _, _ = env.step(np.int64(0))
    assert (reward, ended) == (0.0, True)
    env.close()


@pytest.mark.sim
def test_an_avoiding_uav_hits_fewer_persons_than_a_straight_one() -> None:
    def hits(uav: str) -> int:
        env = SurrogateEnv(dataclasses.replace(OURS, uav=uav, types=("person",)))  # type: ignore[arg-type]
        count = sum(bool(fly(env, seed, action=3)[-1][2]["collided"]) for seed in range(8))
        env.close()
        return count

    assert hits("straight") > hits("avoiding")


@pytest.mark.sim
def test_the_papers_reward_pays_nothing_for_standing_aside() -> None:
    env = SurrogateEnv(dataclasses.replace(PAPERS, types=("person",)))
    for seed in range(3):
        state, _ = env.reset(seed=seed)
        while np.hypot(*state[:2]) * 10 < 4.0:  # nearer to the marker than four metres
            seed += 10
            state, _ = env.reset(seed=seed)
        over = False
        while not over:
            _, reward, ended, cut, info = env.step(np.int64(4))
            assert (reward, info["hidden"]) == (0.0, 0.0)
            over = ended or cut
    env.close()


@pytest.mark.sim
def test_the_papers_reward_pays_for_hiding_the_marker() -> None:
    env = SurrogateEnv(dataclasses.replace(PAPERS, types=("person",), state="relative"))
    paid = [
        (reward, info)
        for seed in range(4)
        for _, reward, info in fly(env, seed, action=3)[1:]
        if info["hidden"] > 0
    ]
    env.close()
    assert paid
    for reward, info in paid:
        if info["hidden"] < 1 and not info["collided"]:
            assert reward == pytest.approx(min(5.0, 1 / (1 - info["hidden"])))
