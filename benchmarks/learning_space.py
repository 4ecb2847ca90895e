"""What leaving the environment to the genetic algorithm buys the learner (the paper's figure).

The reduced space is the surrogate's: one object, a fixed marker, five actions.  The full one
adds what the paper's online rival controls: weather and light, which every action may change a
little instead of moving the object, and a marker anywhere.  Both learn by the paper's reward,
which comes from the segmentation: as in the paper's own surrogate, weather changes nothing that is
rewarded there, and the learner has to find that out.
``python -m benchmarks.learning_space`` trains both and draws ``docs/pictures/learning-space.png``.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from rich.progress import Progress

from pytest_garl.adversary.dqn import EpisodeRecord, train
from pytest_garl.adversary.states import ACTIONS, LIMIT
from pytest_garl.adversary.surrogate import Observation, Surrogate, SurrogateEnv
from pytest_garl.adversary.training import PRESETS
from pytest_garl.scenarios.maps import Map, load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair

WEATHER = 9
TOP = 0.15
STEP = 0.01
"""The paper's online rival alters a condition by 0.01 at a time."""
STAY = 4
PICTURE = Path("docs/pictures/learning-space.png")


class FullSpaceEnv(SurrogateEnv):
    """The surrogate with everything in one agent's hands."""

    def __init__(self, surrogate: Surrogate) -> None:
        super().__init__(surrogate)
        size = self.observation_space.shape[0] + WEATHER + 2  # type: ignore[index]
        self.observation_space = gymnasium.spaces.Box(-LIMIT, LIMIT, (size,), np.float32)
        self.action_space = gymnasium.spaces.Discrete(len(ACTIONS) + 2 * WEATHER)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Draw an episode, its weather and its marker."""
        observation, info = super().reset(seed=seed, options=options)
        self._weather = self.np_random.uniform(0, TOP, WEATHER)
        return self._whole(observation), info

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Move the object, or change a condition while it stays."""
        change = int(action) - len(ACTIONS)
        if change >= 0:
            place, sign = change // 2, 1 - 2 * (change % 2)
            self._weather[place] = np.clip(self._weather[place] + sign * STEP, 0, TOP)
        moved = np.int64(STAY) if change >= 0 else action
        observation, reward, ended, cut, info = super().step(moved)
        return self._whole(observation), reward, ended, cut, info

    def _draw(self, map: Map, kind: str) -> tuple[Scenario, Map]:
        scenario, place = super()._draw(map, kind)
        x, y = (float(value) for value in self.np_random.uniform(-1, 1, 2))
        scenario = repair(scenario.replace({"marker.x": x, "marker.y": y}), place)
        self._marker = (scenario["marker.x"], scenario["marker.y"])
        return scenario, place

    def _whole(self, observation: Observation) -> Observation:
        extra = [*(self._weather / TOP), *self._marker]
        return np.concatenate([observation, np.array(extra, dtype=np.float32)])


def draw(curves: dict[str, Sequence[EpisodeRecord]], path: Path) -> None:
    """Draw the rewards, means of fifty episodes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplots()
    for name, curve in curves.items():
        window = min(50, len(curve))
        rewards = [record.reward for record in curve]
        means = np.convolve(rewards, np.ones(window) / window, "valid")
        axes.plot(np.arange(window - 1, len(curve)), means, label=name)
    axes.set(xlabel="episode", ylabel="reward per episode (mean of 50)")
    axes.grid(alpha=0.3)
    axes.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main() -> None:
    """Train both, resuming where an earlier call stopped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=800)
    parser.add_argument("--full-episodes", type=int, default=4200)
    arguments = parser.parse_args()
    surrogate, training = PRESETS["dqn-paper"]
    surrogate = dataclasses.replace(surrogate, maps=(load_map("court"), load_map("lawn")))
    curves: dict[str, Sequence[EpisodeRecord]] = {}
    runs = (
        ("object only", SurrogateEnv, arguments.episodes),
        ("environment and object", FullSpaceEnv, arguments.full_episodes),
    )
    with Progress() as bar:
        for name, env, episodes in runs:
            task = bar.add_task(name, total=episodes)
            checkpoint = Path(f".garl/learning-space/{name.replace(' ', '-')}.pt")
            learner = train(
                surrogate,
                dataclasses.replace(training, episodes=episodes),
                checkpoint,
                lambda record, task=task: bar.update(task, completed=record.episode + 1),  # type: ignore[misc]
                env=env,
            )
            curves[name] = learner.history
    draw(curves, PICTURE)
    for name, curve in curves.items():
        for end in range(200, len(curve) + 1, 200):
            part = curve[end - 200 : end]
            reward = np.mean([record.reward for record in part])
            hits = np.mean([record.collided for record in part])
            print(f"{name}: episodes to {end}: reward {reward:.2f}, collisions {100 * hits:.0f} %")


if __name__ == "__main__":
    main()
