"""DQN, readable from top to bottom (Mnih et al. 2015; double: van Hasselt et al. 2016)."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import itertools
import json
import pickle
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from pytest_garl.adversary.learned import Network
from pytest_garl.adversary.training.surrogate import Surrogate, SurrogateEnv
from pytest_garl.errors import GarlError

Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Training:
    """Every hyper-parameter; the paper's where it gives one (its supplement, table 1)."""

    seed: int = 0
    episodes: int = 800
    hidden: tuple[int, ...] = (24, 24)
    learning_rate: float = 1e-3
    epsilon: float = 0.99
    epsilon_least: float = 0.01
    epsilon_decay: float = 0.995
    """Per episode."""
    discount: float = 0.99
    batch: int = 64
    replay: int = 50_000
    warm_up: int = 500
    """Decisions before the first update."""
    target_every: int = 500
    """Updates after which the target network is the network again."""
    double: bool = True
    steps: int = 3
    """Rewards that are summed before a value is taken for the rest."""
    environments: int = 2
    """Episodes flown at the same time, each in a process of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeRecord:
    """What one training episode came to."""

    episode: int
    reward: float
    decisions: int
    collided: bool
    epsilon: float


class Learner:
    """The network, its target, its memory: ``act``, ``remember``, ``update``."""

    def __init__(self, size: int, actions: int, training: Training) -> None:
        self.choices, self.training = actions, training
        self.history: list[EpisodeRecord] = []
        self.rng = np.random.default_rng(training.seed)
        # Who else draws from torch's own generator in this process shall not notice.
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(training.seed)
            self.network, self.target = (_mlp(size, training.hidden, actions) for _ in range(2))
        self.target.load_state_dict(self.network.state_dict())
        self.weights, self.gradient = _one_vector(self.network)
        self.optimiser = torch.optim.Adam([self.weights], lr=training.learning_rate, foreach=False)
        self.updates = 0
        # Ring buffers: state, action, sum of rewards, the state after, its discount (0: ended).
        room = training.replay
        self.states, self.afters = (np.zeros((room, size), np.float32) for _ in range(2))
        self.actions = np.zeros(room, np.int64)
        self.sums, self.discounts = (np.zeros(room, np.float32) for _ in range(2))
        self.stored = 0

    def act(self, states: Array, epsilon: float) -> NDArray[np.int64]:
        """Return an action for each state (n, size): at random with probability ``epsilon``."""
        with torch.no_grad():
            best = self.network(torch.from_numpy(states)).argmax(dim=1).numpy()
        explores = self.rng.random(len(states)) < epsilon
        chance = self.rng.integers(self.choices, size=len(states))
        return np.where(explores, chance, best)

    def remember(
        self, state: Array, action: int, total: float, after: Array, discount: float
    ) -> None:
        """Keep one experience."""
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
            judged = self.target(afters)
            picks = (self.network(afters) if training.double else judged).argmax(dim=1)
            rest = judged.gather(1, picks[:, None]).squeeze(1)
            wanted = torch.from_numpy(self.sums[chosen])
            wanted = wanted + torch.from_numpy(self.discounts[chosen]) * rest
        values = self.network(states).gather(1, actions[:, None]).squeeze(1)
        loss = torch.nn.functional.smooth_l1_loss(values, wanted)
        self.gradient.zero_()
        torch.autograd.backward(loss)
        self.optimiser.step()
        self.updates += 1
        if self.updates % training.target_every == 0:
            self.target.load_state_dict(self.network.state_dict())

    def policy(self, state: str) -> Network:
        """Return the network as NumPy arrays; ``state`` names what goes in."""
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
    """Sums rewards over several steps of one episode before they are remembered."""

    def __init__(self, learner: Learner) -> None:
        self._learner = learner
        self._open: deque[tuple[Array, int, float]] = deque()

    def add(
        self, state: Array, action: int, reward: float, after: Array, *, ended: bool, cut: bool
    ) -> None:
        """Take in one step; ``ended`` leaves nothing to come, ``cut`` is a time-out."""
        training = self._learner.training
        self._open.append((state, action, reward))
        if len(self._open) == training.steps or ended or cut:
            self._close(after, ended)
        while self._open and (ended or cut):
            self._close(after, ended)

    def _close(self, after: Array, ended: bool) -> None:
        gamma = self._learner.training.discount
        total = sum(gamma**index * reward for index, (_, _, reward) in enumerate(self._open))
        discount = 0.0 if ended else gamma ** len(self._open)
        state, action, _ = self._open.popleft()
        self._learner.remember(state, action, total, after, discount)


def train(
    surrogate: Surrogate,
    training: Training,
    checkpoint: Path | None = None,
    report: Callable[[EpisodeRecord], None] = lambda record: None,
    every: int = 50,
) -> Learner:
    """Train, telling ``report`` of each episode; return the learner.

    Episodes are flown in rounds of ``environments``, each from a seed of its own, so that a
    training that goes on from its ``checkpoint``, written about ``every`` so many episodes,
    ends with the same weights as one that was never interrupted.
    """
    envs: Any = gymnasium.vector.AsyncVectorEnv(
        [functools.partial(SurrogateEnv, surrogate)] * training.environments,
        context="spawn",
        autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED,
    )
    with contextlib.closing(envs), one_thread():
        size, actions = envs.single_observation_space.shape[0], envs.single_action_space.n
        learner = Learner(size, int(actions), training)
        if checkpoint and checkpoint.exists():
            _restore(learner, checkpoint, identity(surrogate, training))
        kept = len(learner.history)
        while len(learner.history) < training.episodes:
            for record in _round(envs, learner, len(learner.history)):
                # The last round may fly more than was asked for.
                if record.episode < training.episodes:
                    report(record)
                    learner.history.append(record)
            done = len(learner.history)
            if checkpoint and (done - kept >= every or done >= training.episodes):
                _keep(learner, checkpoint, identity(surrogate, training))
                kept = done
    return learner


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch compute on one thread: the cores are for flying, and sums are the same anywhere."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _round(envs: Any, learner: Learner, first: int) -> Iterator[EpisodeRecord]:
    """Fly one episode per environment to its end, learning meanwhile."""
    training, count = learner.training, learner.training.environments
    decayed = training.epsilon * training.epsilon_decay**first
    epsilon = max(training.epsilon_least, decayed)
    seeds = np.random.SeedSequence((training.seed, first)).generate_state(count)
    states, _ = envs.reset(seed=[int(seed) for seed in seeds])
    experiences = [Experience(learner) for _ in range(count)]
    flying = np.ones(count, dtype=bool)
    totals, decisions = np.zeros(count), np.zeros(count, dtype=int)
    collided = np.zeros(count, dtype=bool)
    while flying.any():
        actions = learner.act(states, epsilon)
        envs.step_async(actions)
        # The simulator flies in other processes: time to learn, once for each decision.
        for _ in range(int(flying.sum())):
            learner.update()
        afters, rewards, ended, cut, info = envs.step_wait()
        for index in range(count):
            if not flying[index]:
                continue
            experiences[index].add(
                states[index],
                int(actions[index]),
                float(rewards[index]),
                afters[index],
                ended=bool(ended[index]),
                cut=bool(cut[index]),
            )
            totals[index] += rewards[index]
            decisions[index] += 1
            collided[index] = bool(info["collided"][index])
        flying &= ~(ended | cut)
        states = afters
    for index in range(count):
        yield EpisodeRecord(
            episode=first + index,
            reward=float(totals[index]),
            decisions=int(decisions[index]),
            collided=bool(collided[index]),
            epsilon=epsilon,
        )


def _one_vector(network: torch.nn.Module) -> tuple[torch.nn.Parameter, torch.Tensor]:
    """Make a network's parameters pieces of one vector, and their gradients pieces of another.

    The optimiser then steps once instead of for each of them, to the same bits: for a network as
    small as this a third of an update's time.
    """
    parts = list(network.parameters())
    weights = torch.nn.Parameter(torch.cat([part.detach().flatten() for part in parts]))
    weights.grad = gradient = torch.zeros_like(weights)
    sizes = [part.numel() for part in parts]
    owns, slopes = torch.split(weights.detach(), sizes), torch.split(gradient, sizes)
    for part, own, slope in zip(parts, owns, slopes, strict=True):
        part.data, part.grad = own.view_as(part), slope.view_as(part)
    return weights, gradient


def _mlp(size: int, hidden: tuple[int, ...], actions: int) -> torch.nn.Sequential:
    sizes = (size, *hidden)
    layers: list[torch.nn.Module] = []
    for wide, narrow in itertools.pairwise(sizes):
        layers += [torch.nn.Linear(wide, narrow), torch.nn.ReLU()]
    return torch.nn.Sequential(*layers, torch.nn.Linear(sizes[-1], actions))


_MEMORY = ("states", "afters", "actions", "sums", "discounts")


@functools.cache
def sources_sha256() -> str:
    """Return the hash of the code that a training depends on: adversary, simulation, scenarios."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[2]
    for folder in ("adversary", "simulation", "scenarios"):
        for file in sorted((package / folder).rglob("*.py")):
            name = file.relative_to(package).as_posix()
            digest.update(name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def identity(surrogate: Surrogate, training: Training) -> str:
    """Return a hash of what is trained and how; another training has another."""
    maps = [map.sha256 for map in surrogate.maps]
    what = (sources_sha256(), dataclasses.replace(surrogate, maps=()), maps, training)
    return hashlib.sha256(repr(what).encode()).hexdigest()


def _keep(learner: Learner, path: Path, known: str) -> None:
    filled = min(learner.stored, learner.training.replay)
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_suffix(".part")
    torch.save(
        {
            "identity": known,
            "network": learner.network.state_dict(),
            "target": learner.target.state_dict(),
            "optimiser": learner.optimiser.state_dict(),
            "updates": learner.updates,
            "stored": learner.stored,
            "rng": json.dumps(learner.rng.bit_generator.state),
            "history": json.dumps([dataclasses.astuple(record) for record in learner.history]),
            **{name: torch.from_numpy(getattr(learner, name)[:filled]) for name in _MEMORY},
        },
        half,
    )
    half.replace(path)


def _restore(learner: Learner, path: Path, known: str) -> None:
    try:
        kept = torch.load(path, weights_only=True)
        found = kept["identity"]
    except (OSError, EOFError, RuntimeError, LookupError, TypeError, pickle.PickleError) as error:
        raise GarlError(
            f"{path}: is no checkpoint that can be read ({error}); delete it"
        ) from error
    if found != known:
        raise GarlError(
            f"{path}: is the checkpoint of another training; delete it, choose another folder, "
            "or train as before"
        )
    learner.network.load_state_dict(kept["network"])
    learner.target.load_state_dict(kept["target"])
    learner.optimiser.load_state_dict(kept["optimiser"])
    learner.updates, learner.stored = kept["updates"], kept["stored"]
    learner.rng.bit_generator.state = json.loads(kept["rng"])
    for name in _MEMORY:
        rows = kept[name].numpy()
        getattr(learner, name)[: len(rows)] = rows
    fields = [field.name for field in dataclasses.fields(EpisodeRecord)]
    learner.history = [
        EpisodeRecord(**dict(zip(fields, values, strict=True)))
        for values in json.loads(kept["history"])
    ]
