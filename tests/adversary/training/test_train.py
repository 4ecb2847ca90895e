from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

pytest.importorskip("torch")
from gymnasium.utils.env_checker import check_env

from pytest_garl.adversary.learned import learned_spec
from pytest_garl.adversary.training.dqn import (
    EpisodeRecord,
    Experience,
    Learner,
    Training,
    identity,
    train,
)
from pytest_garl.adversary.training.episode import Episode, draw_episode
from pytest_garl.adversary.training.surrogate import Surrogate, SurrogateEnv
from pytest_garl.adversary.training.train import PRESETS
from pytest_garl.adversary.training.uav_models import StraightPilot
from pytest_garl.adversary.training.validation import validate
from pytest_garl.cli import main
from pytest_garl.errors import GarlError
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.simulation.npc_policy import STAY

COURT = (load_map("court"),)
OURS = Surrogate(maps=COURT)
PAPERS = Surrogate(maps=COURT, uav="straight", state="paper", reward="paper")
ONLINE = dataclasses.replace(PRESETS["online-rl"][0], maps=COURT)


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
    env = SurrogateEnv(ONLINE)
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
def test_walking_into_the_column_of_a_blind_uav_collides_and_ends_the_episode() -> None:
    env = SurrogateEnv(dataclasses.replace(OURS, uav="straight", kinds=("person",)))
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
def test_an_avoiding_uav_does_not_land_on_who_stands_there() -> None:
    def hits(uav: str) -> int:
        env = SurrogateEnv(dataclasses.replace(OURS, uav=uav, kinds=("person",)))  # type: ignore[arg-type]
        count = sum(bool(fly(env, seed, action=3)[-1][2]["collided"]) for seed in range(8))
        env.close()
        return count

    assert hits("straight") > hits("avoiding")


@pytest.mark.sim
def test_the_papers_reward_pays_nothing_to_who_stands_aside() -> None:
    env = SurrogateEnv(dataclasses.replace(PAPERS, kinds=("person",)))
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
    env = SurrogateEnv(dataclasses.replace(PAPERS, kinds=("person",), state="relative"))
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


def test_rewards_of_several_steps_are_summed_and_cut_rightly() -> None:
    learner = Learner(10, 5, Training(steps=3, discount=0.5, replay=10))
    step = Experience(learner)
    states = [np.full(10, index, np.float32) for index in range(6)]
    for index in range(4):
        step.add(states[index], index, 1.0, states[index + 1], ended=False, cut=False)
    assert learner.stored == 2
    step.add(states[4], 4, 8.0, states[5], ended=True, cut=False)
    assert learner.stored == 5
    # 1 + 1/2 + 1/4; then with the last 8; what ended has no rest.
    assert learner.sums[:5] == pytest.approx([1.75, 1.75, 1.5 + 2.0, 1.0 + 4.0, 8.0])
    assert learner.discounts[:5] == pytest.approx([0.125, 0.125, 0, 0, 0])
    assert [int(state[0]) for state in learner.afters[:2]] == [3, 4]
    cut = Experience(learner)
    cut.add(states[0], 0, 1.0, states[1], ended=False, cut=True)
    assert learner.discounts[5] == pytest.approx(0.5)


def test_a_learner_learns_which_action_pays() -> None:
    learner = Learner(4, 5, Training(steps=1, warm_up=64, target_every=50))
    rng = np.random.default_rng(0)
    for _ in range(600):
        state = rng.normal(size=4).astype(np.float32)
        action = int(rng.integers(5))
        learner.remember(state, action, float(action == (0 if state[0] > 0 else 2)), state, 0.0)
        learner.update()
    states = rng.normal(size=(200, 4)).astype(np.float32)
    best = learner.act(states, epsilon=0.0)
    assert (best == np.where(states[:, 0] > 0, 0, 2)).mean() > 0.95
    policy = learner.policy("paper")
    assert [int(policy.values(state).argmax()) for state in states] == best.tolist()


@pytest.mark.sim
def test_a_time_out_ends_with_the_last_decision() -> None:
    scenario, place = draw_episode(COURT[0], ["dog"], np.random.default_rng(0))
    episode = Episode(scenario, place, StraightPilot, time_limit_s=3.0)
    ends = []
    for _ in range(6):
        episode.step([STAY])
        ends.append(episode.outcome)
    episode.close()
    assert ends == [None] * 5 + ["not_landed"]


@pytest.mark.sim
def test_validation_is_the_same_for_any_number_of_processes() -> None:
    network = Learner(10, 5, Training()).policy("relative")
    blind = dataclasses.replace(OURS, uav="straight")
    one, two = (validate(network, blind, 6, processes) for processes in (1, 2))
    assert one == two
    assert one.episodes == 6


def test_another_kind_of_episode_is_another_training() -> None:
    first = identity(OURS, Training())
    assert first == identity(dataclasses.replace(OURS), Training())
    others = (
        identity(dataclasses.replace(OURS, environment="drawn"), Training()),
        identity(OURS, Training(seed=1)),
        identity(PAPERS, Training()),
    )
    assert len({first, *others}) == 4


class _StopError(Exception):
    pass


@pytest.mark.sim
def test_a_killed_training_goes_on_to_the_same_weights(tmp_path: Path) -> None:
    training = Training(episodes=6, warm_up=64)
    whole = train(OURS, training)

    def stop(record: EpisodeRecord) -> None:
        if record.episode == 4:
            raise _StopError

    checkpoint = tmp_path / "half.pt"
    with pytest.raises(_StopError):
        train(OURS, training, checkpoint, stop, every=2)
    resumed = train(OURS, training, checkpoint, every=2)
    assert whole.updates == resumed.updates > 0
    assert whole.history == resumed.history
    for ours, theirs in zip(
        whole.policy("relative").layers, resumed.policy("relative").layers, strict=True
    ):
        assert (ours[0] == theirs[0]).all()
        assert (ours[1] == theirs[1]).all()
    with pytest.raises(GarlError, match="checkpoint of another training"):
        train(OURS, dataclasses.replace(training, seed=1), checkpoint)
    for nonsense in (b"", b"nonsense"):
        checkpoint.write_bytes(nonsense)
        with pytest.raises(GarlError, match="no checkpoint that can be read"):
            train(OURS, training, checkpoint)


@pytest.mark.sim
def test_garl_train_writes_weights_that_can_be_flown(tmp_path: Path) -> None:
    out = tmp_path / "dogs.npz"
    arguments = ["train", "--map=court", "--type=dog", "--episodes=2", "--seeds=2"]
    arguments += [
        "--state=extended",
        "--uav=both",
        "--validation=2",
        f"--folder={tmp_path / 'folder'}",
        f"--out={out}",
    ]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert "kept seed" in result.output
    assert learned_spec(str(out)).make()
    manifest = json.loads(out.with_suffix(".json").read_text())
    assert manifest["surrogate"]["types"] == ["dog"]
    assert (manifest["state"], manifest["surrogate"]["uav"]) == ("extended", "both")
    assert manifest["validation"].keys() == {"0", "1"}
    assert manifest["other_episodes"]["episodes"] == 2
    assert len(manifest["sources"]) == 64
    assert out.with_suffix(".png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--type=cat"], "--type: found 'cat', expected some of person, dog, bird"),
        (["--map=moon"], "unknown map 'moon'"),
        (["--type=,"], "found ',', expected names"),
        (["--out=policy.pt"], "expected a name that ends in .npz"),
        (["--system=nowhere:System"], "--system: found 'nowhere:System', which cannot be loaded"),
    ],
)
def test_bad_arguments_are_one_clear_error(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(main, ["train", *arguments])
    assert result.exit_code == 1
    assert words in result.output
    assert "Traceback" not in result.output
