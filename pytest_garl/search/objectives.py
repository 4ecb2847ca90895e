"""What the search maximises: the paper's three objectives, as functions of values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def diversity(generation: Matrix) -> Matrix:
    """Return each chromosome's mean Euclidean distance to the generation (paper, eq. 1).

    ``generation`` is (k, d), properties normalised to [0, 1]; the sum runs over all k
    members, the chromosome itself (at distance 0) among them, and is divided by k.
    """
    differences = generation[:, None, :] - generation[None, :, :]
    distances: Matrix = np.sqrt((differences**2).sum(axis=2))
    means: Matrix = distances.mean(axis=1)
    return means
