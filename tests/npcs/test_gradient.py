"""Learning in NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from pytest_garl.npcs.gradient import (
    Adam,
    Layers,
    Stopping,
    StoppingRate,
    _backwards,
    _signals,
    _StoppingTable,
    learned_when_to_go,
    untrained,
)
from pytest_garl.npcs.learned import Array

SIZES = (6, 24, 24, 2)


def batch(count: int = 64) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    # Some expected values are so far away that the loss is linear there.
    return (
        rng.normal(size=(count, SIZES[0])),
        rng.integers(SIZES[-1], size=count),
        rng.normal(scale=2.0, size=count),
    )


def values_of(layers: Layers, states: Array) -> Array:
    """Return the values of each action for many states, (n, actions)."""
    return _signals(layers, states)[-1]


def loss_and_gradient(
    layers: Layers, states: Array, actions: NDArray[np.int64], expected: Array
) -> tuple[float, Layers]:
    """Return the mean Huber loss of the chosen actions' values, and its gradient.

    The loss of a difference d is d²/2 up to 1 and |d| - 1/2 beyond.
    """
    signals, rows = _signals(layers, states), np.arange(len(states))
    difference = signals[-1][rows, actions] - expected
    size = np.abs(difference)
    loss = np.where(size < 1, difference**2 / 2, size - 0.5).mean()
    slope = np.zeros_like(signals[-1])
    slope[rows, actions] = np.clip(difference, -1.0, 1.0) / len(states)
    return float(loss), _backwards(layers, signals, slope)


def test_the_gradient_is_that_of_small_differences() -> None:
    layers = untrained("belief", SIZES, seed=0).layers
    states, actions, expected = batch()
    _, gradient = loss_and_gradient(layers, states, actions, expected)
    for number, (row, column) in enumerate([(3, 2), (7, 11), (1, 20)]):
        losses = []
        for change in (1e-6, -1e-6):
            moved = [(weight.copy(), bias) for weight, bias in layers]
            moved[number][0][row, column] += change
            losses.append(loss_and_gradient(tuple(moved), states, actions, expected)[0])
        slope = (losses[0] - losses[1]) / 2e-6
        assert gradient[number][0][row, column] == pytest.approx(slope, abs=1e-8)


def test_gradient_and_step_are_those_of_torch() -> None:
    torch = pytest.importorskip("torch")
    layers = untrained("belief", SIZES, seed=0).layers
    states, actions, expected = batch()
    parts = [torch.tensor(part, requires_grad=True) for layer in layers for part in layer]
    optimiser = torch.optim.Adam(parts, lr=1e-3)
    adam = Adam(layers, 1e-3)
    for _ in range(3):
        signal = torch.tensor(states)
        for index in range(0, len(parts), 2):
            signal = signal @ parts[index].T + parts[index + 1]
            signal = torch.relu(signal) if index < len(parts) - 2 else signal
        values = signal.gather(1, torch.tensor(actions)[:, None]).squeeze(1)
        loss = torch.nn.functional.smooth_l1_loss(values, torch.tensor(expected))
        optimiser.zero_grad()
        loss.backward()
        own_loss, gradient = loss_and_gradient(layers, states, actions, expected)
        assert own_loss == pytest.approx(loss.item(), abs=1e-10)
        for own, part in zip((each for layer in gradient for each in layer), parts, strict=True):
            assert np.abs(own - part.grad.numpy()).max() < 1e-10
        optimiser.step()
        layers = adam.step(layers, gradient)
    for own, part in zip((each for layer in layers for each in layer), parts, strict=True):
        assert np.abs(own - part.detach().numpy()).max() < 1e-10


def test_one_state_has_the_values_that_a_policy_computes() -> None:
    network = untrained("belief", SIZES, seed=0)
    states, _, _ = batch(5)
    rows = values_of(network.layers, states)
    for state, row in zip(states, rows, strict=True):
        assert network.values(state) == pytest.approx(row, abs=1e-12)


def when_to_go(worths: list[list[float]], never: float = 0.0) -> list[Stopping]:
    """Return things that wait, whose input is the number of the decision and which thing it is."""
    return [
        Stopping(
            states=np.array([[step / 10, float(number)] for step in range(len(go))]),
            go=np.array(go),
            never=never,
        )
        for number, go in enumerate(worths)
    ]


def test_the_slope_of_the_worth_is_that_of_small_changes() -> None:
    things = when_to_go([[0.1, 0.7, 0.2], [0.4, 0.3]], never=0.25)
    logits = np.array([-0.5, 0.3, 1.0, -1.0, 0.2])

    def loss(values: np.ndarray) -> float:
        total, first = 0.0, 0
        for thing in things:
            still = 1.0
            for go in thing.go:
                share = 1 / (1 + math.exp(-values[first]))
                total, still, first = total - still * share * go, still * (1 - share), first + 1
            total -= still * thing.never
        return total / len(things)

    slope = _StoppingTable(things).slope(1 / (1 + np.exp(-logits)))
    for index in range(len(logits)):
        moved = [loss(logits + change * np.eye(len(logits))[index]) for change in (1e-6, -1e-6)]
        assert slope[index] == pytest.approx((moved[0] - moved[1]) / 2e-6, abs=1e-9)


def test_it_learns_when_to_go_even_if_the_rule_that_it_starts_from_does_not() -> None:
    things = when_to_go([[0.0] * 6 + [1.0] * 2 + [0.0] * 4, [0.0, 0.0, 1.0] + [0.0] * 7])
    at_once = np.ones(sum(len(thing.go) for thing in things))
    network = untrained("belief", (2, 16, 16, 2), seed=3)
    settings = StoppingRate(imitates=5, steps=400, learning_rate=1e-2)
    learned = learned_when_to_go(network, things, at_once, settings)
    for thing in things:
        values = values_of(learned.layers, thing.states)
        went = int((values[:, 1] > values[:, 0]).argmax())
        assert thing.go[went] == 1.0
    again = learned_when_to_go(network, things, at_once, settings)
    assert learned.layers[0][0].tobytes() == again.layers[0][0].tobytes()
