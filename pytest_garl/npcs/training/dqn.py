"""Deep Q-learning: DQN (Mnih et al. 2015) and double DQN (van Hasselt et al. 2016)."""

from __future__ import annotations

import contextlib
import itertools
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from pytest_garl.npcs.learned import Network
from pytest_garl.npcs.training.presets import Training

Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeRecord:
    """The result of one training episode."""

    episode: int
    reward: float
    decisions: int
    collided: bool
    epsilon: float


class Learner:
    """A Q-network, its target network and its replay memory.

    ``size`` is the length of a state, ``actions`` the number of actions.
    """

    def __init__(self, size: int, actions: int, training: Training) -> None:
        self.action_count, self.training = actions, training
        self.history: list[EpisodeRecord] = []
        self.rng = np.random.default_rng(training.seed)
        # Other code in this process may draw from torch's global generator.
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(training.seed)
            self.network, self.target = (_mlp(size, training.hidden, actions) for _ in range(2))
        self.target.load_state_dict(self.network.state_dict())
        self.weights, self.gradient = _one_vector(self.network)
        self.optimiser = torch.optim.Adam([self.weights], lr=training.learning_rate, foreach=False)
        self.updates = 0
        # The replay memory, as ring buffers: state, action, sum of rewards, the state after them,
        # and the discount of that state's value, 0 if the episode ended.
        capacity = training.replay
        self.states, self.afters = (np.zeros((capacity, size), np.float32) for _ in range(2))
        self.actions = np.zeros(capacity, np.int64)
        self.sums, self.discounts = (np.zeros(capacity, np.float32) for _ in range(2))
        self.stored = 0

    def act(self, states: Array, epsilon: float) -> NDArray[np.int64]:
        """Return an action for each state (n, size): at random with probability ``epsilon``."""
        with torch.no_grad():
            best = self.network(torch.from_numpy(states)).argmax(dim=1).numpy()
        explores = self.rng.random(len(states)) < epsilon
        random = self.rng.integers(self.action_count, size=len(states))
        return np.where(explores, random, best)

    def remember(
        self, state: Array, action: int, total: float, after: Array, discount: float
    ) -> None:
        """Store one experience."""
        place = self.stored % self.training.replay
        self.states[place], self.afters[place] = state, after
        self.actions[place], self.sums[place], self.discounts[place] = action, total, discount
        self.stored += 1

    def update(self) -> None:
        """Take one step of gradient descent on a batch from the memory."""
        training = self.training
        if self.stored < training.warm_up:
            return
        chosen = self.rng.integers(min(self.stored, training.replay), size=training.batch)
        states, afters = (torch.from_numpy(each[chosen]) for each in (self.states, self.afters))
        actions = torch.from_numpy(self.actions[chosen])
        with torch.no_grad():
            target_values = self.target(afters)
            next_values = self.network(afters) if training.double else target_values
            next_actions = next_values.argmax(dim=1)
            remaining = target_values.gather(1, next_actions[:, None]).squeeze(1)
            expected = torch.from_numpy(self.sums[chosen])
            expected = expected + torch.from_numpy(self.discounts[chosen]) * remaining
        values = self.network(states).gather(1, actions[:, None]).squeeze(1)
        loss = torch.nn.functional.smooth_l1_loss(values, expected)
        self.gradient.zero_()
        torch.autograd.backward(loss)
        self.optimiser.step()
        self.updates += 1
        if self.updates % training.target_every == 0:
            self.target.load_state_dict(self.network.state_dict())

    def policy(self, state: str) -> Network:
        """Return the network as NumPy arrays; ``state`` names the encoding of its input."""
        linear = [layer for layer in self.network if isinstance(layer, torch.nn.Linear)]
        return Network(
            state=state,
            layers=tuple(
                (
                    layer.weight.detach().numpy().astype(np.float64),
                    layer.bias.detach().numpy().astype(np.float64),
                )
                for layer in linear
            ),
        )


class Experience:
    """Turns the steps of one episode into n-step experiences, which the learner stores."""

    def __init__(self, learner: Learner) -> None:
        self._learner = learner
        self._pending: deque[tuple[Array, int, float]] = deque()

    def add(
        self,
        state: Array,
        action: int,
        reward: float,
        after: Array,
        *,
        terminated: bool,
        truncated: bool,
    ) -> None:
        """Add one step; after ``terminated`` no reward follows, ``truncated`` is a time-out."""
        training = self._learner.training
        self._pending.append((state, action, reward))
        if len(self._pending) == training.steps or terminated or truncated:
            self._store_oldest(after, terminated)
        while self._pending and (terminated or truncated):
            self._store_oldest(after, terminated)

    def _store_oldest(self, after: Array, terminated: bool) -> None:
        gamma = self._learner.training.discount
        total = 0.0
        for index, (_, _, reward) in enumerate(self._pending):
            total += gamma**index * reward
        discount = 0.0 if terminated else gamma ** len(self._pending)
        state, action, _ = self._pending.popleft()
        self._learner.remember(state, action, total, after, discount)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch compute on one thread, so that its sums do not depend on the number of cores.

    The other cores fly.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _one_vector(network: torch.nn.Module) -> tuple[torch.nn.Parameter, torch.Tensor]:
    """Make a network's parameters views of one vector, and their gradients views of another.

    The optimiser then steps once instead of once for each parameter, to the same bits.  That
    saves a third of an update's time in a network this small.
    """
    parts = list(network.parameters())
    weights = torch.nn.Parameter(torch.cat([part.detach().flatten() for part in parts]))
    weights.grad = gradient = torch.zeros_like(weights)
    sizes = [part.numel() for part in parts]
    weight_views, gradient_views = (
        torch.split(vector, sizes) for vector in (weights.detach(), gradient)
    )
    for part, weight, slope in zip(parts, weight_views, gradient_views, strict=True):
        part.data, part.grad = weight.view_as(part), slope.view_as(part)
    return weights, gradient


def _mlp(size: int, hidden: tuple[int, ...], actions: int) -> torch.nn.Sequential:
    sizes = (size, *hidden)
    layers: list[torch.nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.ReLU()]
    return torch.nn.Sequential(*layers, torch.nn.Linear(sizes[-1], actions))
