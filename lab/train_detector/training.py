"""Training: crops first, whole frames at the end; every hyper-parameter in one place."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from lab.train_detector.dataset import CROP_PX, Samples, load_shard
from lab.train_detector.losses import LossWeights, loss_of, targets_of
from lab.train_detector.model import TphYolo, follow
from landing_systems.modules.detection_tphyolo.decoding import cells_of

Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainPlan:
    """The settings of a training; with the pictures they decide the weights, on one kind of CPU.

    The learning rate rises over ``warm_up`` steps and falls along a cosine.  Whole frames
    (``frames`` a step) follow on crops (``crops`` a step) for the last ``frame_share`` of the
    steps: a crop is a tenth of the work of a frame.
    """

    steps: int = 15000
    seed: int = 0
    crops: int = 32
    crop_px: int = 128
    frames: int = 6
    frame_share: float = 0.15
    learning_rate: float = 3e-3
    warm_up: int = 200
    weight_decay: float = 1e-2
    average: float = 0.998
    """Decay of the moving average of the weights that is kept."""
    clip: float = 10.0
    losses: LossWeights = field(default_factory=LossWeights)
    checkpoint_steps: int = 250


class Trainer:
    """The state of a training: it can be stopped after any step and continued."""

    def __init__(
        self,
        plan: TrainPlan,
        crops: Sequence[Samples],
        frames: Sequence[Samples],
        device: str = "cpu",
    ) -> None:
        torch.manual_seed(plan.seed)
        self.plan, self.step, self._device = plan, 0, torch.device(device)
        self._crops, self._frames = _Pool(crops), _Pool(frames)
        self.model = TphYolo().train().to(self._device)
        nn.utils.convert_conv2d_weight_memory_format(self.model, torch.channels_last)
        self.averaged = copy.deepcopy(self.model)
        self.averaged.eval().requires_grad_(False)
        matrices = [each for each in self.model.parameters() if each.ndim > 1]
        vectors = [each for each in self.model.parameters() if each.ndim <= 1]
        self._optimiser = torch.optim.AdamW(
            [
                {"params": matrices, "weight_decay": plan.weight_decay},
                {"params": vectors, "weight_decay": 0.0},
            ],
            lr=plan.learning_rate,
        )

    def advance(self) -> float:
        """Do one step; return its loss."""
        plan = self.plan
        rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(self.step,)))
        if self.step < (1 - plan.frame_share) * plan.steps:
            images, labels, regions = self._crops.draw(rng, plan.crops)
            images, labels, regions = shifted(rng, images, labels, regions, plan.crop_px)
            images, labels, regions = turned(rng, images, labels, regions)
        else:
            images, labels, regions = self._frames.draw(rng, plan.frames)
        height, width = images.shape[1:3]
        batch = torch.from_numpy(varied(rng, images)).to(self._device).permute(0, 3, 1, 2)
        for group in self._optimiser.param_groups:
            group["lr"] = self._rate()
        self._optimiser.zero_grad()
        grid = torch.from_numpy(cells_of(width, height).copy()).to(self._device)
        loss = loss_of(
            self.model(batch), targets_of(labels, regions, width, height), grid, plan.losses
        )
        torch.autograd.backward(loss)
        nn.utils.clip_grad_norm_(self.model.parameters(), plan.clip)
        self._optimiser.step()
        follow(self.averaged, self.model, self.step, plan.average)
        self.step += 1
        return float(loss.detach())

    def save(self, file: Path) -> None:
        """Write a checkpoint."""
        part = file.with_suffix(".part")
        state: dict[str, Any] = {
            "step": self.step,
            "model": self.model.state_dict(),
            "averaged": self.averaged.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "plan": asdict(self.plan),
        }
        torch.save(state, part)
        part.rename(file)

    def load(self, file: Path) -> bool:
        """Continue from a checkpoint of the same plan; return whether there was one."""
        if not file.exists():
            return False
        state = torch.load(file, map_location=self._device, weights_only=True)
        if state["plan"] != asdict(self.plan):
            return False
        self.step = int(state["step"])
        self.model.load_state_dict(state["model"])
        self.averaged.load_state_dict(state["averaged"])
        self._optimiser.load_state_dict(state["optimiser"])
        return True

    def _rate(self) -> float:
        plan = self.plan
        warm = min(1.0, (self.step + 1) / plan.warm_up)
        return plan.learning_rate * warm * (0.01 + 0.99 * _cosine(self.step / plan.steps))


def train(
    plan: TrainPlan,
    data: Path,
    shards: int,
    on_step: Callable[[int, float], None],
    device: str = "cpu",
) -> TphYolo:
    """Train on the shards in ``data`` and return the averaged network, on the CPU.

    ``on_step`` is called with each step's number and loss.  A checkpoint in ``data`` is continued.
    """
    crops = [load_shard(data, index, "crops") for index in range(shards)]
    frames = [load_shard(data, index, "frames") for index in range(shards)]
    trainer = Trainer(plan, crops, frames, device)
    file = data / f"finder-{plan.seed}-{plan.steps}-{shards}.pt"
    trainer.load(file)
    while trainer.step < plan.steps:
        on_step(trainer.step + 1, trainer.advance())
        if trainer.step % plan.checkpoint_steps == 0 or trainer.step == plan.steps:
            trainer.save(file)
    return trainer.averaged.cpu()


def seconds_per_step(plan: TrainPlan, data: Path, device: str = "cpu") -> float:
    """Measure steps on crops, about what a step of the whole training takes."""
    samples = [load_shard(data, 0, kind) for kind in ("crops", "frames")]
    trainer = Trainer(plan, samples[:1], samples[1:], device)
    trainer.advance()
    began = time.perf_counter()
    for _ in range(_TIMED_STEPS):
        trainer.advance()
    return (time.perf_counter() - began) / _TIMED_STEPS


_TIMED_STEPS = 20


class _Pool:
    """All samples of some shards, drawn from at random."""

    def __init__(self, shards: Sequence[Samples]) -> None:
        self._shards = shards
        self._starts = np.cumsum([0, *(len(shard.images) for shard in shards)])

    def draw(self, rng: np.random.Generator, count: int) -> tuple[NDArray[np.uint8], Array, Array]:
        chosen = np.sort(rng.integers(self._starts[-1], size=count))
        owners = np.searchsorted(self._starts, chosen, side="right") - 1
        parts = [
            (shard.images[row], shard.labels[row], shard.regions[row])
            for shard, row in (
                (self._shards[owner], index - self._starts[owner])
                for owner, index in zip(owners, chosen, strict=True)
            )
        ]
        images, labels, regions = zip(*parts, strict=True)
        return np.stack(images), np.stack(labels), np.stack(regions)


def shifted(
    rng: np.random.Generator, images: NDArray[np.uint8], labels: Array, regions: Array, size: int
) -> tuple[NDArray[np.uint8], Array, Array]:
    """Cut squares of ``size`` from crops, each at another place."""
    places = rng.integers(0, CROP_PX - size + 1, (len(images), 2))
    cut = [image[y : y + size, x : x + size] for image, (x, y) in zip(images, places, strict=True)]
    labels, regions = labels.copy(), regions - np.tile(places, 2)
    labels[:, :, :2] -= places[:, None]
    return np.stack(cut), labels, regions.astype(np.float32)


def turned(
    rng: np.random.Generator, images: NDArray[np.uint8], labels: Array, regions: Array
) -> tuple[NDArray[np.uint8], Array, Array]:
    """Turn each square picture by a random number of right angles: ids do not mind."""
    size = images.shape[1]
    images, labels, regions = images.copy(), labels.copy(), regions.copy()
    for index, quarters in enumerate(rng.integers(0, 4, len(images))):
        images[index] = np.rot90(images[index], quarters)
        for _ in range(quarters):
            x, y, width, height = labels[index, :, :4].T.copy()
            labels[index, :, :4] = np.stack([y, size - x, height, width], 1)
            left, top, right, bottom = regions[index]
            regions[index] = (top, size - right, bottom, size - left)
    labels[labels[:, :, 3] <= 0, :2] = 0.0
    return images, labels, regions


def varied(rng: np.random.Generator, images: NDArray[np.uint8]) -> Array:
    """Vary brightness, contrast and colour a little; return RGB in [0, 1]."""
    count = len(images)
    gains = np.exp(rng.normal(0, 0.12, (count, 1, 1, 1)) + rng.normal(0, 0.04, (count, 1, 1, 3)))
    offsets = rng.normal(0, 0.03, (count, 1, 1, 1))
    result = images.astype(np.float32) * (gains / 255).astype(np.float32)
    result += offsets.astype(np.float32)
    return np.clip(result, 0, 1, out=result)


def _cosine(share: float) -> float:
    return 0.5 * (1 + math.cos(math.pi * min(1.0, share)))
