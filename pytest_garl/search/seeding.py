"""The random numbers of a search."""

from __future__ import annotations

import hashlib

import numpy as np


def seed_sequence(method: str, map: str, seed: int, *key: int) -> np.random.SeedSequence:
    """Return the seeds of one search, independent of those of other methods and other maps."""
    digest = hashlib.sha256(f"{method} {map}".encode()).digest()
    return np.random.SeedSequence(seed, spawn_key=(int.from_bytes(digest[:4], "big"), *key))
