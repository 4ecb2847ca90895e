"""Fits the network of the detectability oracle, and measures predictions of probabilities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import rankdata

from pytest_garl.flight.detectability import Network

Array = NDArray[np.float64]
HIDDEN_UNITS = 8
RIDGE = 1e-3
"""Weight of the squares of the weights, so that none grows without need."""
MOST_ITERATIONS = 1500
_DECIMALS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Bin:
    """Frames whose predictions are alike: their number, mean prediction and share read."""

    count: int
    predicted: float
    observed: float

    @property
    def error(self) -> float:
        """Prediction less observation."""
        return self.predicted - self.observed


def fit(features: Array, read: Array, units: int = HIDDEN_UNITS) -> Network:
    """Return the network of the largest likelihood for features (n, k) and reads (n,) of 0 or 1."""
    mean, spread = features.mean(axis=0), features.std(axis=0) + 1e-9
    scaled = (features - mean) / spread
    inputs = features.shape[1]
    rng = np.random.default_rng(0)
    start = np.concatenate(
        [rng.uniform(0, 1, units * inputs), rng.normal(0, 1, units), rng.uniform(1, 3, units), [-4]]
    )
    sizes = (units * inputs, units, units, 1)
    lows = (0.0, None, 0.0, None)
    bounds = [(low, None) for low, size in zip(lows, sizes, strict=True) for _ in range(size)]
    found: Any = minimize(
        _loss,
        start,
        args=(scaled, read, units),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": MOST_ITERATIONS, "maxfun": 2 * MOST_ITERATIONS},
    )
    weights, biases, outputs, bias = _parts(found.x, inputs, units)
    weights = weights / spread
    return Network(
        weights=tuple(tuple(_rounded(row)) for row in weights),
        biases=tuple(_rounded(biases - weights @ mean)),
        outputs=tuple(_rounded(outputs)),
        bias=_rounded(np.array([bias]))[0],
    )


def auc(predicted: Array, read: Array) -> float:
    """Return the probability that a read frame has a higher prediction than an unread one."""
    ranks, hits = rankdata(predicted), read > 0.5
    yes, no = int(hits.sum()), int((~hits).sum())
    return float((ranks[hits].sum() - yes * (yes + 1) / 2) / (yes * no)) if yes and no else 0.5


def brier(predicted: Array, read: Array) -> float:
    """Return the mean squared error of the predictions."""
    return float(((predicted - read) ** 2).mean())


def tenths(predicted: Array, read: Array) -> list[Bin]:
    """Return the frames by tenths of the range of predictions: 0 to 0.1, 0.1 to 0.2, ..."""
    place = np.minimum(9, (10 * predicted).astype(int))
    return [_bin(predicted, read, place == index) for index in range(10)]


def deciles(predicted: Array, read: Array) -> list[Bin]:
    """Return the frames in ten groups of equal size, in the order of their predictions."""
    order = np.argsort(predicted, kind="stable")
    groups = np.array_split(order, 10)
    return [_bin(predicted, read, group) for group in groups]


def _bin(predicted: Array, read: Array, chosen: NDArray[Any]) -> Bin:
    some = predicted[chosen]
    if not len(some):
        return Bin(count=0, predicted=0.0, observed=0.0)
    return Bin(count=len(some), predicted=float(some.mean()), observed=float(read[chosen].mean()))


def _loss(values: Array, features: Array, read: Array, units: int) -> tuple[float, Array]:
    """Return the mean negative logarithm of the likelihood, with the ridge, and its gradient."""
    weights, biases, outputs, bias = _parts(values, features.shape[1], units)
    hidden = _logistic(features @ weights.T + biases)
    chance = _logistic(hidden @ outputs + bias)
    surprise = -np.log(np.where(read > 0.5, chance, 1 - chance) + 1e-12).mean()
    ridge = RIDGE / units * ((weights**2).sum() + 0.1 * (outputs**2).sum())
    wrong = (chance - read) / len(read)
    back = np.outer(wrong, outputs) * hidden * (1 - hidden)
    gradient = (
        (back.T @ features + 2 * RIDGE / units * weights).ravel(),
        back.sum(axis=0),
        hidden.T @ wrong + 0.2 * RIDGE / units * outputs,
        [wrong.sum()],
    )
    return float(surprise + ridge), np.concatenate(gradient)


def _parts(values: Array, inputs: int, units: int) -> tuple[Array, Array, Array, float]:
    cut = units * inputs
    return (
        values[:cut].reshape(units, inputs),
        values[cut : cut + units],
        values[cut + units : cut + 2 * units],
        float(values[-1]),
    )


def _logistic(values: Array) -> Array:
    result: Array = 1 / (1 + np.exp(-np.clip(values, -40.0, 40.0)))
    return result


def _rounded(values: Array) -> list[float]:
    return [round(float(value), _DECIMALS) for value in values]
