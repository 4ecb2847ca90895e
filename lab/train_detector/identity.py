"""The second network reads a marker's id from a patch: a smaller form of TPH-YOLOv5's classifier.

The first network could not learn ids: with four of them it was no better than chance after 1,750
steps, because markers are rotated by any angle.  A classifier of patches learns ids in a few
hundred steps.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from lab.train_detector.dataset import Samples
from lab.train_detector.losses import (
    MIN_CONTRAST,
    MIN_SEEN,
    MIN_SIDE_PX,
    visible_part,
)
from lab.train_detector.model import Convolution, follow
from landing_systems.modules.detection_tphyolo.decoding import CLASS_IDS
from landing_systems.modules.detection_tphyolo.patches import PATCH_PX, normalised, patch

OTHER = len(CLASS_IDS)
"""The class of markers with another id, and of patches without a marker."""
_CELLS = PATCH_PX // 8


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentityPlan:
    """The settings of the training of the second network."""

    steps: int = 9000
    seed: int = 0
    patches: int = 64
    nothing: float = 0.15
    """Share of patches from anywhere, without the middle of a marker."""
    mirrored: float = 0.1
    """Share of mirror images of known markers.  They look like markers, but belong to OTHER."""
    others: float = 0.3
    """Share of markers with another id.  There are 46 other ids, and the worst error is to take one
    for the id of the target."""
    shift: float = 0.06
    resize: float = 0.08
    """Standard deviations of the errors of a patch, about those of the first network: ``shift`` of
    its middle as a share of the marker's side, ``resize`` of the logarithm of its size."""
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    average: float = 0.998
    """Decay of the moving average of the weights."""


class IdentityNet(nn.Sequential):
    """Maps patches (n, 3, P, P) to logits (n, ids + 1); the last class is ``OTHER``."""

    def __init__(self) -> None:
        super().__init__(
            Convolution(3, 16),
            Convolution(16, 32, 3, 2),
            Convolution(32, 40),
            Convolution(40, 64, 3, 2),
            Convolution(64, 64, 3, 2),
            nn.Flatten(),
            nn.Linear(64 * _CELLS**2, 48),
            nn.ReLU(inplace=True),
            nn.Linear(48, OTHER + 1),
        )


class PatchSampler:
    """Draws random patches, with their classes, from the crops of the data set."""

    def __init__(self, shards: Sequence[Samples], plan: IdentityPlan) -> None:
        self._shards, self._plan = shards, plan
        size = shards[0].images.shape[1]
        legible = [
            (number, picture, row)
            for number, shard in enumerate(shards)
            for picture, row in zip(*np.nonzero(shard.labels[:, :, 2] > 0), strict=True)
            if _legible(shard.labels[picture, row], shard.regions[picture], size)
        ]
        places = np.array(legible, np.intp).reshape(-1, 3)
        ids = np.array([int(shards[s].labels[p, r, 4]) for s, p, r in legible])
        classes = np.where(ids < OTHER, ids, OTHER)
        self._by_class = [places[classes == each] for each in range(OTHER + 1)]

    def draw(self, rng: np.random.Generator) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        """Return patches (n, P, P, 3) and their classes, the known ids about equally often."""
        plan = self._plan
        patches, classes = [], []
        for _ in range(plan.patches):
            chance = rng.random()
            if chance < plan.nothing:
                patches.append(self._patch_without_marker(rng))
                classes.append(OTHER)
                continue
            mirrored = chance < plan.nothing + plan.mirrored
            has_other_id = not mirrored and chance < plan.nothing + plan.mirrored + plan.others
            number = OTHER if has_other_id else int(rng.integers(OTHER))
            markers = self._by_class[number]
            shard, picture, row = markers[rng.integers(len(markers))]
            x, y, _, _, _, _, _, side = self._shards[shard].labels[picture, row]
            across, down = rng.normal(0, plan.shift * side, 2)
            middle = (float(x + across), float(y + down))
            size = float(side) * float(np.exp(rng.normal(0, plan.resize)))
            angle = float(rng.uniform(0, 2 * np.pi))
            cut = patch(self._shards[shard].images[picture], middle, size, angle)
            patches.append(cut[:, ::-1] if mirrored else cut)
            classes.append(OTHER if mirrored else number)
        return np.stack(patches), np.array(classes, np.int64)

    def _patch_without_marker(self, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return a patch from anywhere that does not contain the middle of a marker."""
        while True:
            shard = self._shards[int(rng.integers(len(self._shards)))]
            picture = int(rng.integers(len(shard.images)))
            left, top, right, bottom = shard.regions[picture]
            middle = rng.uniform((left, top), (right, bottom))
            rows = shard.labels[picture]
            side = max(12.0, float(rows[:, 7].max()))
            away = np.abs(rows[:, :2] - middle).max(axis=1)
            if not ((rows[:, 2] > 0) & (away < 0.6 * rows[:, 7])).any():
                angle = float(rng.uniform(0, 2 * np.pi))
                return patch(shard.images[picture], middle.tolist(), side, angle)


def _legible(row: NDArray[np.float32], region: NDArray[np.float32], size: int) -> bool:
    part = visible_part(row, region, size, size)
    return (
        part is not None
        and part[1] * (1 - float(row[5])) >= MIN_SEEN
        and bool(row[6] >= MIN_CONTRAST)
        and bool(row[7] >= MIN_SIDE_PX)
    )


def train_identity(
    plan: IdentityPlan,
    shards: Sequence[Samples],
    on_step: Callable[[int, float], None],
    device: str = "cpu",
) -> IdentityNet:
    """Train on crops and return the averaged network, on the CPU.

    ``on_step`` is called with each step and loss.
    """
    torch.manual_seed(plan.seed)
    patch_sampler = PatchSampler(shards, plan)
    model = IdentityNet().train().to(device)
    averaged = copy.deepcopy(model).eval().requires_grad_(False)
    optimiser = torch.optim.AdamW(
        model.parameters(), lr=plan.learning_rate, weight_decay=plan.weight_decay
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, plan.learning_rate, total_steps=plan.steps, pct_start=0.1
    )
    for step in range(plan.steps):
        rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(1, step)))
        patches, classes = patch_sampler.draw(rng)
        logits: Tensor = model(torch.from_numpy(normalised(patches)).to(device))
        loss = nn.functional.cross_entropy(logits, torch.from_numpy(classes).to(device))
        optimiser.zero_grad()
        torch.autograd.backward(loss)
        optimiser.step()
        schedule.step()
        follow(averaged, model, step, plan.average)
        on_step(step + 1, float(loss.detach()))
    return averaged.cpu()
