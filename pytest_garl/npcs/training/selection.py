"""Trains from several seeds, and keeps the weights with the best validation."""

from __future__ import annotations

import dataclasses
import functools
import platform
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pytest_garl.engine import packages
from pytest_garl.flight.flight import version_of
from pytest_garl.npcs.learned import Network, save
from pytest_garl.npcs.training.checkpoint import identity_of, sources_sha256
from pytest_garl.npcs.training.counterfactuals import COLLIDED, PREVENTABLE, WORTH
from pytest_garl.npcs.training.dqn import EpisodeRecord
from pytest_garl.npcs.training.presets import Surrogate, Training
from pytest_garl.npcs.training.surrogate import env_of
from pytest_garl.npcs.training.train import train

CHOICE_SEEDS_FROM = 2_000_000_000
"""First seed of the episodes that choose between trainings; seeds in training are hashes."""
REPORT_SEEDS_FROM = 3_000_000_000
"""First seed of the episodes for the reported rate.  They choose nothing, so that the rate is not
that of the luckiest training."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingPlan:
    """One call of ``garl train``."""

    name: str
    surrogate: Surrogate
    training: Training
    seeds: tuple[int, ...]
    validation: int
    """Episodes of each validation."""
    folder: Path
    """Where checkpoints are kept."""
    out: Path
    """The file of the weights; manifest and curves are written beside it."""
    processes: int = 1


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


@dataclass(frozen=True, slots=True, kw_only=True)
class MomentScore:
    """How landings end whose NPC begins when a director says so."""

    episodes: int
    collided: int
    preventable: int

    @property
    def rate(self) -> float:
        """The mean worth of a landing."""
        others = self.collided - self.preventable
        worth = WORTH[PREVENTABLE] * self.preventable + WORTH[COLLIDED] * others
        return worth / self.episodes


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingResult:
    """The best seed, and rates: of collisions, or the mean worth of a director's landings.

    ``rates`` has the rate of each seed in validation, ``report`` the score of the best seed on
    other episodes.
    """

    best: int
    rates: Mapping[int, float]
    report: Score | MomentScore


def train_best(
    plan: TrainingPlan,
    on_episode: Callable[[int, EpisodeRecord], None] = lambda seed, record: None,
    on_validation: Callable[[int, float], None] = lambda seed, rate: None,
) -> TrainingResult:
    """Train and validate every seed; write the best weights, their manifest and all curves.

    An interrupted call continues from the checkpoints in the plan's folder.
    """
    curves: dict[int, Sequence[EpisodeRecord]] = {}
    networks, scores = {}, {}
    for seed in plan.seeds:
        training = dataclasses.replace(plan.training, seed=seed)
        checkpoint = plan.folder / f"{plan.name}-{identity_of(plan.surrogate, training)[:12]}.pt"
        learner = train(plan.surrogate, training, checkpoint, functools.partial(on_episode, seed))
        curves[seed], networks[seed] = learner.history, learner.policy(plan.surrogate.state)
        scores[seed] = validate(networks[seed], plan.surrogate, plan.validation, plan.processes)
        on_validation(seed, scores[seed].rate)
    best = max(plan.seeds, key=lambda seed: (scores[seed].rate, -seed))
    report = validate(
        networks[best], plan.surrogate, plan.validation, plan.processes, REPORT_SEEDS_FROM
    )
    save(plan.out, networks[best], _manifest(plan, best, curves[best], scores, report))
    draw_curves(curves, plan.out.with_suffix(".png"))
    rates = {seed: score.rate for seed, score in scores.items()}
    return TrainingResult(best=best, rates=rates, report=report)


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


def _manifest(
    plan: TrainingPlan,
    best: int,
    curve: Sequence[EpisodeRecord],
    scores: Mapping[int, Score],
    report: Score,
) -> dict[str, Any]:
    surrogate, last = plan.surrogate, curve[-100:]
    return {
        "policy": plan.name,
        "seed": best,
        "training": {**dataclasses.asdict(plan.training), "seed": best},
        "surrogate": {
            "maps": {map.name: map.sha256 for map in surrogate.maps},
            "types": list(surrogate.types),
            "uav": surrogate.uav,
            "grades": list(surrogate.grades),
            "reward": surrogate.reward,
            "environment": surrogate.environment,
            "airframe": dataclasses.asdict(surrogate.airframe),
        },
        "last_100_episodes": {
            "reward": round(float(np.mean([record.reward for record in last])), 4),
            "collided": round(float(np.mean([record.collided for record in last])), 4),
        },
        "validation": {str(seed): dataclasses.asdict(score) for seed, score in scores.items()},
        "other_episodes": dataclasses.asdict(report),
        "sources": sources_sha256(),
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Return the versions of all that trains and flies."""
    names = sorted({*packages(), "torch", "gymnasium"} - {"opencv-python-headless"})
    return {"python": platform.python_version(), **{name: version_of(name) for name in names}}


def draw_curves(curves: Mapping[int, Sequence[EpisodeRecord]], path: Path) -> None:
    """Draw reward and collision rate over the episodes: means of fifty, one line per seed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for seed, curve in curves.items():
        window = min(50, len(curve))
        kernel = np.ones(window) / window
        episodes = np.arange(window - 1, len(curve))
        rewards = np.convolve([record.reward for record in curve], kernel, "valid")
        collisions = np.convolve([float(record.collided) for record in curve], kernel, "valid")
        left.plot(episodes, rewards, label=f"seed {seed}")
        right.plot(episodes, 100 * collisions, label=f"seed {seed}")
    left.set(xlabel="episode", ylabel="reward per episode (mean of 50)")
    right.set(xlabel="episode", ylabel="collisions, % (of 50)", ylim=(0, 100))
    for axes in (left, right):
        axes.grid(alpha=0.3)
    left.legend(fontsize="small")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})
