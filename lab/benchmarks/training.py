"""The time of training a policy for 800 episodes of one seed, in total and per decision.

``python -m lab.benchmarks.training`` trains the default policy from random weights, without
validation.
"""

from __future__ import annotations

import argparse
import dataclasses
import time

from pytest_garl.npcs.training.presets import PRESETS
from pytest_garl.npcs.training.train import train
from pytest_garl.scenarios.maps.loading import load_map


def main() -> None:
    """Train and print the time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--policy", choices=list(PRESETS), default="dqn")
    parser.add_argument("--episodes", type=int, default=800)
    arguments = parser.parse_args()
    preset = PRESETS[arguments.policy]
    surrogate = dataclasses.replace(preset.surrogate, maps=(load_map("court"), load_map("lawn")))
    training = dataclasses.replace(preset.training, episodes=arguments.episodes)
    began = time.perf_counter()
    learner = train(surrogate, training)
    elapsed_s = time.perf_counter() - began
    decisions = sum(record.decisions for record in learner.history)
    print(
        f"{arguments.policy}: {arguments.episodes} episodes in {elapsed_s:.0f} s, "
        f"{decisions} decisions of {1000 * elapsed_s / decisions:.1f} ms, {learner.updates} updates"
    )


if __name__ == "__main__":
    main()
