"""The detectability oracle: how probably a good detector reads the marker in a frame.

A small monotone network of the facts of a ``MarkerView``: one layer of logistic units whose weights
are not negative, and a logistic unit over them.  The study of detectability fits it to frames that
detectors have read and writes ``detectability.json``; docs/results/detectability.md tells how
good it is.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import GarlError
from pytest_garl.files.json_values import dataclass_from, parse_json
from pytest_garl.files.user_files import MEGABYTE, read_bytes
from pytest_garl.flight.flight import MarkerView

Array = NDArray[np.float64]
READABLE = 0.5
"""From this probability on a marker counts as readable in a frame."""
COEFFICIENTS = Path(__file__).with_name("detectability.json")
FEATURES = (
    "log2 of the pixels per module",
    "logarithm of the contrast",
    "logarithm of contrast over noise",
    "border not hidden",
    "bits not hidden",
    "margin not hidden",
    "light not uneven",
    "air not cluttered",
    "modules to the frame's edge",
    "share in the frame",
    "modules not blurred",
)
"""What the network takes.  A larger value never makes a marker harder to read."""
_LEAST_PX = 0.05
_MOST_MODULES = 20.0
"""A marker is 7 modules wide: farther beyond the frame's edge, or blurred over more, is as bad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """The coefficients: p = s(bias + sum of v s(w x + b)), where s is the logistic function.

    ``weights`` are one row per hidden unit with one value, not below 0, per feature;
    ``outputs`` are not below 0 either.
    """

    weights: tuple[tuple[float, ...], ...]
    biases: tuple[float, ...]
    outputs: tuple[float, ...]
    bias: float

    def probabilities(self, features: Array) -> Array:
        """Return the probability of each row of features (n, k), shape (n,)."""
        hidden = _logistic(features @ np.array(self.weights).T + np.array(self.biases))
        chances: Array = _logistic(hidden @ np.array(self.outputs) + self.bias)
        return chances


@functools.lru_cache(maxsize=4096)
def readable_probability(view: MarkerView | None) -> float:
    """Return the probability that a detector of markers reads the frame.

    0 where the marker is not in the frame or there was no camera.  More pixels and more contrast
    never lower it; more that is hidden, noise, blur, clutter or uneven light never raises it.
    """
    if view is None:
        return 0.0
    return float(_fitted().probabilities(np.array([features(view)]))[0])


def features(view: MarkerView) -> tuple[float, ...]:
    """Return ``FEATURES`` of a view."""
    px = max(_LEAST_PX, view.px_per_module)
    contrast = 1.0 + max(0.0, view.contrast)
    return (
        math.log2(px),
        math.log(contrast),
        math.log(contrast / max(1.0, view.noise)),
        -view.border_hidden,
        -view.bits_hidden,
        -view.margin_hidden,
        -view.uneven_light,
        -view.clutter,
        max(-_MOST_MODULES, view.edge_modules),
        view.share_in_frame,
        -min(_MOST_MODULES, view.blur_px / px),
    )


@functools.cache
def _fitted() -> Network:
    content = read_bytes(COEFFICIENTS, MEGABYTE, GarlError)
    return dataclass_from(Network, parse_json(content))


def _logistic(values: Array) -> Array:
    result: Array = 1 / (1 + np.exp(-np.clip(values, -40.0, 40.0)))
    return result
