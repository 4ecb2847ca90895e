"""One generator per purpose, all from the scenario's own seed."""

from __future__ import annotations

import numpy as np

PURPOSES = (
    "ground",
    "sensor",
    "pose",
    "particles",
    "objects",
    "wind",
    "navigation",
    "timing",
    "rangefinder",
    "depth",
    "wear",
    "dirt",
)


def generator(seed: int, purpose: str, index: int = 0) -> np.random.Generator:
    """Return the generator of one purpose; ``index`` tells objects apart."""
    key = (PURPOSES.index(purpose), index)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
