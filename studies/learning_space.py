"""Learning in the reduced space of the paper, compared with the full space (the paper's figure).

The reduced space is the surrogate's: one object, a fixed marker, five actions.  The full space is
that of ``garl train --policy=online-rl``: an action may also change weather or light a little, and
the marker may lie anywhere.  Both policies learn with the paper's reward, which comes from the
segmentation.  As in the paper's surrogate, weather does not change this reward, and the learner
has to find that out.
``python -m studies.learning_space`` trains both and draws ``docs/pictures/learning-space.png``.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.progress import Progress

from pytest_garl.adversary.training.dqn import EpisodeRecord
from pytest_garl.adversary.training.presets import PRESETS
from pytest_garl.adversary.training.train import train
from pytest_garl.scenarios.maps.loading import load_map

PICTURE = Path("docs/pictures/learning-space.png")


def draw(curves: dict[str, Sequence[EpisodeRecord]], path: Path) -> None:
    """Draw the rewards as means over fifty episodes."""
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
    """Train both; an interrupted training is continued."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=800)
    parser.add_argument("--full-episodes", type=int, default=4200)
    arguments = parser.parse_args()
    maps = (load_map("court"), load_map("lawn"))
    curves: dict[str, Sequence[EpisodeRecord]] = {}
    runs = (
        ("object only", "dqn-paper", arguments.episodes),
        ("environment and object", "online-rl", arguments.full_episodes),
    )
    with Progress() as bar:
        for name, policy, episodes in runs:
            preset = PRESETS[policy]
            task = bar.add_task(name, total=episodes)
            checkpoint = Path(f".garl/learning-space/{name.replace(' ', '-')}.pt")
            learner = train(
                dataclasses.replace(preset.surrogate, maps=maps),
                dataclasses.replace(preset.training, episodes=episodes),
                checkpoint,
                lambda record, task=task: bar.update(task, completed=record.episode + 1),  # type: ignore[misc]
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
