"""Trains one learner on episodes of the surrogate, several at a time."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from pytest_garl.npcs.training.checkpoint import (
    identity_of,
    restore_checkpoint,
    save_checkpoint,
)
from pytest_garl.npcs.training.dqn import EpisodeRecord, Experience, Learner, one_thread
from pytest_garl.npcs.training.presets import Surrogate, Training
from pytest_garl.npcs.training.surrogate import env_of


def train(
    surrogate: Surrogate,
    training: Training,
    checkpoint: Path | None = None,
    on_episode: Callable[[EpisodeRecord], None] = lambda record: None,
    checkpoint_interval: int = 50,
) -> Learner:
    """Train and return the learner; call ``on_episode`` after each episode.

    Episodes are flown in rounds of ``training.environments``, each from its own seed.  The file
    ``checkpoint`` is written about every ``checkpoint_interval`` episodes.  A training that
    continues from it ends with the same weights as one without interruption.
    """
    envs: Any = gymnasium.vector.AsyncVectorEnv(
        [functools.partial(env_of, surrogate)] * training.environments,
        context="spawn",
        autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED,
    )
    identity = identity_of(surrogate, training)
    with contextlib.closing(envs), one_thread():
        size, actions = envs.single_observation_space.shape[0], envs.single_action_space.n
        learner = Learner(size, int(actions), training)
        if checkpoint and checkpoint.exists():
            restore_checkpoint(learner, checkpoint, identity)
        saved = len(learner.history)
        while len(learner.history) < training.episodes:
            for record in _fly_round(envs, learner, len(learner.history)):
                # The last round may fly more episodes than the training has.
                if record.episode < training.episodes:
                    on_episode(record)
                    learner.history.append(record)
            done = len(learner.history)
            if checkpoint and (done - saved >= checkpoint_interval or done >= training.episodes):
                save_checkpoint(learner, checkpoint, identity)
                saved = done
    return learner


def _fly_round(envs: Any, learner: Learner, first: int) -> Iterator[EpisodeRecord]:
    """Fly one episode per environment to its end, and learn meanwhile."""
    training, count = learner.training, learner.training.environments
    decayed = training.epsilon * training.epsilon_decay**first
    epsilon = max(training.epsilon_least, decayed)
    seeds = np.random.SeedSequence((training.seed, first)).generate_state(count)
    states, _ = envs.reset(seed=[int(seed) for seed in seeds])
    experiences = [Experience(learner) for _ in range(count)]
    flying = np.ones(count, dtype=bool)
    totals, decisions = np.zeros(count), np.zeros(count, dtype=int)
    collided = np.zeros(count, dtype=bool)
    while flying.any():
        actions = learner.act(states, epsilon)
        envs.step_async(actions)
        # Learn once for each decision while the simulator flies in other processes.
        for _ in range(int(flying.sum()) * training.updates):
            learner.update()
        afters, rewards, terminated, truncated, info = envs.step_wait()
        for index in range(count):
            if not flying[index]:
                continue
            experiences[index].add(
                states[index],
                int(actions[index]),
                float(rewards[index]),
                afters[index],
                terminated=bool(terminated[index]),
                truncated=bool(truncated[index]),
            )
            totals[index] += rewards[index]
            decisions[index] += 1
            collided[index] = bool(info["collided"][index])
        flying &= ~(terminated | truncated)
        states = afters
    for index in range(count):
        yield EpisodeRecord(
            episode=first + index,
            reward=float(totals[index]),
            decisions=int(decisions[index]),
            collided=bool(collided[index]),
            epsilon=epsilon,
        )
