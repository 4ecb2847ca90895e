"""Collision rates of a policy in the surrogate, on episodes that no training used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from pytest_garl.npcs.learned import Network
from pytest_garl.npcs.training.graded import env_of
from pytest_garl.npcs.training.presets import Surrogate

CHOICE_SEEDS_FROM = 2_000_000_000
"""First seed of the episodes that choose between trainings; seeds in training are hashes."""
REPORT_SEEDS_FROM = 3_000_000_000
"""First seed of the episodes for the reported rate.  They choose nothing, so that the rate is not
that of the luckiest training."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Episodes flown, and how they ended."""

    episodes: int
    collided: int
    blocked: int

    @property
    def rate(self) -> float:
        """Share of episodes that ended in a collision with the object."""
        return self.collided / self.episodes


def validate(
    network: Network,
    surrogate: Surrogate,
    episodes: int,
    processes: int = 1,
    seeds_from: int = CHOICE_SEEDS_FROM,
) -> Score:
    """Return the score of a network that always takes its best action."""
    chunks = np.array_split(np.arange(seeds_from, seeds_from + episodes), max(1, processes))
    jobs = [(network, surrogate, [int(seed) for seed in chunk]) for chunk in chunks]
    if processes > 1:
        with ProcessPoolExecutor(processes) as pool:
            ends = [end for part in pool.map(_fly_all, jobs) for end in part]
    else:
        ends = [end for job in jobs for end in _fly_all(job)]
    return Score(
        episodes=len(ends),
        collided=sum(collided for _, collided in ends),
        blocked=sum(outcome == "not_landed" for outcome, _ in ends),
    )


def _fly_all(job: tuple[Network, Surrogate, Sequence[int]]) -> list[tuple[str, bool]]:
    network, surrogate, seeds = job
    env = env_of(surrogate)

    def best(state: Any) -> int:
        return int(np.argmax(network.values(state)))

    ends = [_fly(env, best, seed) for seed in seeds]
    env.close()
    return ends


def _fly(env: Any, act: Callable[[Any], int], seed: int) -> tuple[str, bool]:
    state, info = env.reset(seed=seed)
    over = False
    while not over:
        state, _, ended, cut, info = env.step(np.int64(act(state)))
        over = ended or cut
    return str(info["outcome"]), bool(info["collided"])
