"""Thompson sampling (Thompson 1933): choose the arm with the best draw of its success."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

TRIAL_WEIGHT = 0.9
"""Weight of an arm's trials after one more trial, because arms change as they are searched."""


class Bandit:
    """Arms with a Beta distribution of their success each; an arm without trials is uniform."""

    def __init__(self, weight: float = TRIAL_WEIGHT) -> None:
        self._weight = weight
        self._trials: defaultdict[str, tuple[float, float]] = defaultdict(lambda: (0.0, 0.0))

    def choose(self, arms: Sequence[str], rng: np.random.Generator) -> str:
        """Return one of the arms."""
        trials = np.array([self._trials[arm] for arm in arms])
        return arms[int(np.argmax(rng.beta(1 + trials[:, 0], 1 + trials[:, 1])))]

    def learn(self, arm: str, success: float) -> None:
        """Take in the success of a trial, 0 to 1."""
        wins, losses = self._trials[arm]
        self._trials[arm] = (
            self._weight * wins + success,
            self._weight * losses + 1 - success,
        )
