"""Learning in NumPy: the gradient of a Q-network, Adam, and learning when to go.

It needs no torch, because it runs on the user's machine.  It uses one thread, double precision and
its own seed, so the same rows give the same bytes on every CPU that :mod:`pytest_garl.cpu_dispatch`
makes alike.  A test checks that torch's gradient is the same within rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pytest_garl.npcs.learned import Array, Network

Layers = tuple[tuple[Array, Array], ...]


def untrained(state: str, sizes: Sequence[int], seed: int) -> Network:
    """Return a network with random weights, as torch draws them: ±1/√inputs.

    ``state`` is the name of its input, ``sizes`` the number of inputs, of hidden units, of actions.
    """
    rng = np.random.default_rng(seed)
    layers = []
    for inputs, outputs in itertools.pairwise(sizes):
        bound = 1 / math.sqrt(inputs)
        layers.append(
            (rng.uniform(-bound, bound, (outputs, inputs)), rng.uniform(-bound, bound, outputs))
        )
    return Network(state=state, layers=tuple(layers))


def _signals(layers: Layers, states: Array) -> list[Array]:
    """Return the input of each layer, and the last one's output."""
    signals = [states]
    for weight, bias in layers[:-1]:
        signals.append(np.maximum(signals[-1] @ weight.T + bias, 0.0))
    weight, bias = layers[-1]
    return [*signals, signals[-1] @ weight.T + bias]


def _backwards(layers: Layers, signals: Sequence[Array], slope: Array) -> Layers:
    """Return the gradient of the weights for the slope of the loss at the output, (n, actions)."""
    gradient: list[tuple[Array, Array]] = []
    for signal, (weight, _) in zip(reversed(signals[:-1]), reversed(layers), strict=True):
        gradient.append((slope.T @ signal, slope.sum(axis=0)))
        # The signal is what ReLU let through: where it is 0, the weights have no effect.
        slope = (slope @ weight) * (signal > 0)
    return tuple(reversed(gradient))


class Adam:
    """Adam (Kingma and Ba 2015) with the usual constants."""

    def __init__(self, layers: Layers, learning_rate: float) -> None:
        self._rate, self._steps = learning_rate, 0
        self._means, self._squares = (
            [np.zeros_like(part) for layer in layers for part in layer] for _ in range(2)
        )

    def step(self, layers: Layers, gradient: Layers) -> Layers:
        """Return the weights after one step."""
        self._steps += 1
        first, second = 1 - 0.9**self._steps, 1 - 0.999**self._steps
        parts = []
        weights = [part for layer in layers for part in layer]
        slopes = [part for layer in gradient for part in layer]
        for index, (part, slope) in enumerate(zip(weights, slopes, strict=True)):
            self._means[index] = 0.9 * self._means[index] + 0.1 * slope
            self._squares[index] = 0.999 * self._squares[index] + 0.001 * slope * slope
            size = np.sqrt(self._squares[index] / second) + 1e-8
            parts.append(part - self._rate * (self._means[index] / first) / size)
        return tuple(zip(parts[::2], parts[1::2], strict=True))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stopping:
    """One thing that waits, with the worth of each of its decisions.

    ``states`` (n, inputs) are the inputs at its decisions, ``go`` (n,) is the worth of going at
    each, and ``never`` is the worth of never going.
    """

    states: Array
    go: Array
    never: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingRate:
    """The settings of learning when to go.

    The first ``imitates`` steps learn the decisions of a rule; the next ``steps`` steps follow the
    gradient of the expected worth.  A network that has imitated for long is so sure that it learns
    nothing more.  ``shrinks`` is the weight of the squared weights.
    """

    imitates: int = 40
    steps: int = 300
    learning_rate: float = 5e-3
    shrinks: float = 1e-3


def learned_when_to_go(
    network: Network,
    things: Sequence[Stopping],
    rule: Array,
    settings: StoppingRate,
    towards: Layers | None = None,
) -> Network:
    """Return the network after learning when to go.

    At each decision a thing goes with the probability σ(go - wait).  The worth of every decision is
    known, so the expected worth J of each thing and its gradient need no samples:
    ∂J/∂(go - wait) = S p (1 - p) (worth of go - expected worth of waiting), where S is the
    probability that the thing still waits.  ``rule`` (n,) says for each decision, thing by thing,
    whether a rule goes; learning starts from it.  Weights shrink towards 0, or towards those of
    ``towards``.
    """
    layers = network.layers
    origin = towards or tuple((np.zeros_like(w), np.zeros_like(b)) for w, b in layers)
    adam = Adam(layers, settings.learning_rate)
    states = np.concatenate([each.states for each in things])
    table = _StoppingTable(things)
    for step in range(settings.imitates + settings.steps):
        signals = _signals(layers, states)
        goes = 1 / (1 + np.exp(np.clip(signals[-1][:, 0] - signals[-1][:, 1], -50, 50)))
        # At first it is the slope of the cross-entropy between the rule and the network.
        imitates = step < settings.imitates
        slope = (goes - rule) / len(rule) if imitates else table.slope(goes)
        gradient = _backwards(layers, signals, np.stack([-slope, slope], axis=1))
        gradient = tuple(
            (of_weight + settings.shrinks * (weight - at), of_bias)
            for (of_weight, of_bias), (weight, _), (at, _) in zip(
                gradient, layers, origin, strict=True
            )
        )
        layers = adam.step(layers, gradient)
    return Network(state=network.state, layers=layers)


class _StoppingTable:
    """The decisions of many things side by side: a row for each, padded at its end."""

    def __init__(self, things: Sequence[Stopping]) -> None:
        longest, count = max(len(each.go) for each in things), len(things)
        self._go, self._is_one = np.zeros((count, longest)), np.zeros((count, longest), dtype=bool)
        self._never = np.array([each.never for each in things])
        for row, each in enumerate(things):
            self._go[row, : len(each.go)], self._is_one[row, : len(each.go)] = each.go, True

    def slope(self, goes: Array) -> Array:
        """Return the slope of the mean loss over each decision's go - wait, (n,)."""
        count, longest = self._go.shape
        share = np.zeros((count, longest))
        share[self._is_one] = goes
        waiting = np.empty((count, longest + 1))
        waiting[:, longest] = self._never
        for column in range(longest - 1, -1, -1):
            part = share[:, column]
            waiting[:, column] = part * self._go[:, column] + (1 - part) * waiting[:, column + 1]
        still = np.cumprod(np.concatenate([np.ones((count, 1)), 1 - share[:, :-1]], axis=1), axis=1)
        gain: Array = still * share * (1 - share) * (self._go - waiting[:, 1:])
        return np.asarray(-gain[self._is_one] / count, dtype=np.float64)
