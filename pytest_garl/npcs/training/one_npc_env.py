"""What both surrogates share: an environment about one NPC in one episode at a time."""

from __future__ import annotations

import gymnasium
import numpy as np
from numpy.typing import NDArray

from pytest_garl.npcs.observations import ENCODINGS, LIMIT
from pytest_garl.npcs.training.episode import Episode
from pytest_garl.npcs.training.presets import Surrogate

Observation = NDArray[np.float32]


class OneNpcEnv(gymnasium.Env[Observation, np.int64]):
    """An environment whose observation and actions are those of a surrogate's encoding."""

    def __init__(self, surrogate: Surrogate) -> None:
        self.surrogate = surrogate
        self._encoding = ENCODINGS[surrogate.state]
        self.observation_space = gymnasium.spaces.Box(
            -LIMIT, LIMIT, (self._encoding.size,), np.float32
        )
        self.action_space = gymnasium.spaces.Discrete(self._encoding.actions)
        self._episode: Episode | None = None

    def close(self) -> None:
        """Free the physics of the last episode."""
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    def _current(self) -> Episode:
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("reset() comes before the first step()")
        return self._episode
