"""One training: episodes of the surrogate, several at a time, and a learner."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from pytest_garl.adversary.training.checkpoint import (
    identity_of,
    restore_checkpoint,
    save_checkpoint,
)
from pytest_garl.adversary.training.dqn import EpisodeRecord, Experience, Learner, one_thread
from pytest_garl.adversary.training.presets import Surrogate, Training
from pytest_garl.adversary.training.surrogate import SurrogateEnv


def train(
    surrogate: Surrogate,
    training: Training,
    checkpoint: Path | None = None,
    report: Callable[[EpisodeRecord], None] = lambda record: None,
    every: int = 50,
) -> Learner:
    """Train and return the learner; call ``report`` after each episode.

    Episodes are flown in rounds of ``environments``, each from its own seed.  So a training that
    continues from its ``checkpoint``, which is written about every ``every`` episodes, ends with
    the same weights as one without interruption.
    """
    envs: Any = gymnasium.vector.AsyncVectorEnv(
        [functools.partial(SurrogateEnv, surrogate)] * training.environments,
        context="spawn",
        autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED,
    )
    identity = identity_of(surrogate, training)
    with contextlib.closing(envs), one_thread():
        size, actions = envs.single_observation_space.shape[0], envs.single_action_space.n
        learner = Learner(size, int(actions), training)
        if checkpoint and checkpoint.exists():
            restore_checkpoint(learner, checkpoint, identity)
        kept = len(learner.history)
        while len(learner.history) < training.episodes:
            for record in _round(envs, learner, len(learner.history)):
                # The last round may fly more episodes than the training has.
                if record.episode < training.episodes:
                    report(record)
                    learner.history.append(record)
            done = len(learner.history)
            if checkpoint and (done - kept >= every or done >= training.episodes):
                save_checkpoint(learner, checkpoint, identity)
                kept = done
    return learner


def _round(envs: Any, learner: Learner, first: int) -> Iterator[EpisodeRecord]:
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
        for _ in range(int(flying.sum())):
            learner.update()
        afters, rewards, ended, cut, info = envs.step_wait()
        for index in range(count):
            if not flying[index]:
                continue
            experiences[index].add(
                states[index],
                int(actions[index]),
                float(rewards[index]),
                afters[index],
                ended=bool(ended[index]),
                cut=bool(cut[index]),
            )
            totals[index] += rewards[index]
            decisions[index] += 1
            collided[index] = bool(info["collided"][index])
        flying &= ~(ended | cut)
        states = afters
    for index in range(count):
        yield EpisodeRecord(
            episode=first + index,
            reward=float(totals[index]),
            decisions=int(decisions[index]),
            collided=bool(collided[index]),
            epsilon=epsilon,
        )
