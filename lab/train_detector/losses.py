"""The losses of the first network, the detector, and the cells that must report each marker."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from landing_systems.modules.detection_tphyolo.decoding import (
    BASE_CELLS,
    STRIDES,
    cells_of,
)

Array = NDArray[np.float32]
MIN_SEEN = 0.45
"""Visible share of a marker.  Below it the id is a guess, so the marker is left out of the loss:
the network need neither find it nor take it for ground."""
MIN_CONTRAST = 8.0
"""Grey levels between white and black.  Less is hard to tell from the sensor's noise."""
MIN_SIDE_PX = 8.0
"""About a pixel per cell, below which a DICT_5X5 code cannot be read."""
LEVEL_OCTAVES = 1.0
"""A scale's cells report boxes from half to twice its base size, so most boxes have two scales."""
REACH = 0.9
"""In cells: a cell reports a box if its centre is nearer than this to the middle of the box's
visible part.  These are up to four cells, as in YOLOv5, where neighbouring cells share a target."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LossWeights:
    """Weights of the losses, each a mean over the cells that report a marker."""

    box: float = 1.5
    objectness: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Targets:
    """The right outputs of the cells of a batch.

    ``cells`` (k, 2) are (picture, cell) that report a marker, ``boxes`` (k, 4) its centre and size.
    ``ignored`` (n, cells) are left out of the loss of objectness.
    """

    cells: NDArray[np.int64]
    boxes: Array
    ignored: NDArray[np.bool_]


def targets_of(labels: Array, regions: Array, width: int, height: int) -> Targets:
    """Assign cells to markers; ``labels`` and ``regions`` are as in ``dataset.Samples``."""
    grid = cells_of(width, height)
    ignored = np.zeros((len(labels), grid.shape[1]), np.bool_)
    chosen: list[tuple[int, int]] = []
    boxes: list[Array] = []
    nearest: dict[tuple[int, int], float] = {}
    for picture, (rows, region) in enumerate(zip(labels, regions, strict=True)):
        for row in rows[rows[:, 2] > 0]:
            visible = visible_part(row, region, width, height)
            if visible is None:
                continue
            middle, share = visible
            legible = row[6] >= MIN_CONTRAST and row[7] >= MIN_SIDE_PX
            if share * (1 - row[5]) < MIN_SEEN or not legible:
                away = np.abs(grid[:2] - row[:2, None]) / (row[2:4, None] / 2)
                ignored[picture] |= away.max(axis=0) < 1
                continue
            for cell in _responsible_cells(grid, row, middle):
                key, distance = (picture, int(cell)), float(np.hypot(*(grid[:2, cell] - middle)))
                if nearest.get(key, math.inf) <= distance:
                    continue
                nearest[key] = distance
                chosen.append(key)
                boxes.append(row[:4])
    return Targets(
        cells=np.array(chosen, np.int64).reshape(-1, 2),
        boxes=np.array(boxes, np.float32).reshape(-1, 4),
        ignored=ignored,
    )


def visible_part(row: Array, region: Array, width: int, height: int) -> tuple[Array, float] | None:
    """Return the middle of a box's part in the picture, and that part's share of the box."""
    low = np.maximum(row[:2] - row[2:4] / 2, np.maximum(region[:2], 0))
    high = np.minimum(row[:2] + row[2:4] / 2, np.minimum(region[2:], (width, height)))
    if (high <= low).any():
        return None
    middle: Array = ((low + high) / 2).astype(np.float32)
    return middle, float(np.prod((high - low) / row[2:4]))


def _responsible_cells(grid: Array, row: Array, middle: Array) -> NDArray[np.intp]:
    """Return the cells that must report the box ``row``, of which ``middle`` is visible."""
    octaves = np.log2(math.sqrt(float(row[2] * row[3])) / (BASE_CELLS * grid[2]))
    smallest, largest = grid[2] == STRIDES[0], grid[2] == STRIDES[-1]
    fits = (np.abs(octaves) <= LEVEL_OCTAVES) | (smallest & (octaves < 0))
    fits |= largest & (octaves > 0)
    near = np.abs(grid[:2] - middle[:, None]).max(axis=0) < REACH * grid[2]
    return np.flatnonzero(fits & near)


def boxes_of(raw: Tensor, cells: Tensor) -> Tensor:
    """Decode outputs (k, 4) of cells (3, k) to centres and sizes (k, 4) in pixels."""
    x, y, stride = cells
    return torch.stack(
        [
            x + raw[:, 0] * stride,
            y + raw[:, 1] * stride,
            BASE_CELLS * stride * raw[:, 2].clamp(-4, 4).exp(),
            BASE_CELLS * stride * raw[:, 3].clamp(-4, 4).exp(),
        ],
        1,
    )


def complete_iou(a: Tensor, b: Tensor) -> Tensor:
    """CIoU of boxes (k, 4) given as centre and size (Zheng et al. 2020), shape (k,)."""
    low = torch.maximum(a[:, :2] - a[:, 2:] / 2, b[:, :2] - b[:, 2:] / 2)
    high = torch.minimum(a[:, :2] + a[:, 2:] / 2, b[:, :2] + b[:, 2:] / 2)
    common = (high - low).clamp(min=0).prod(1)
    iou = common / (a[:, 2:].prod(1) + b[:, 2:].prod(1) - common + 1e-9)
    hull_low = torch.minimum(a[:, :2] - a[:, 2:] / 2, b[:, :2] - b[:, 2:] / 2)
    hull_high = torch.maximum(a[:, :2] + a[:, 2:] / 2, b[:, :2] + b[:, 2:] / 2)
    diagonal = (hull_high - hull_low).square().sum(1) + 1e-9
    distance = (a[:, :2] - b[:, :2]).square().sum(1) / diagonal
    shapes = torch.atan(a[:, 2] / a[:, 3]) - torch.atan(b[:, 2] / b[:, 3])
    aspect = 4 / math.pi**2 * shapes.square()
    with torch.no_grad():
        weight = aspect / (1 - iou + aspect + 1e-9)
    return iou - distance - weight * aspect


def loss_of(raw: Tensor, targets: Targets, grid: Tensor, weights: LossWeights) -> Tensor:
    """Return the loss of a batch's outputs (n, 5, cells)."""
    objectness = torch.zeros_like(raw[:, 4])
    picture, cell = torch.from_numpy(targets.cells).to(raw.device).T
    objectness[picture, cell] = 1.0
    counted = ~torch.from_numpy(targets.ignored).to(raw.device) | (objectness > 0)
    losses = binary_cross_entropy_with_logits(raw[:, 4], objectness, reduction="none")
    count = max(1, len(targets.cells))
    total = weights.objectness * losses[counted].sum() / count
    if len(targets.cells):
        found = boxes_of(raw[picture, :4, cell], grid[:, cell])
        boxes = 1 - complete_iou(found, torch.from_numpy(targets.boxes).to(raw.device))
        total = total + weights.box * boxes.mean()
    return total
