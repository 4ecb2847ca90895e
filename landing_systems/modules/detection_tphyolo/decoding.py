"""From the network's numbers to boxes: cells, sizes, confidence, non-maximum suppression."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
CLASS_IDS = (0, 1, 2, 3)
"""Ids that the network distinguishes as in the paper's published detector (marker0 to marker3); a
marker of another id belongs to no class and is not reported."""
BITS = "DICT_5X5_"
"""How the names of their dictionaries begin: OpenCV's 5x5 ones share their first ids."""
STRIDES = (4, 8, 16, 32)
CHANNELS = 5
"""Centre x and y, logarithms of width and height, objectness."""
BASE_CELLS = 4.0
"""A box of four cells has the logarithm 0."""
NETWORK_SIZE = (320, 240)
"""Width and height in pixels of what the network takes."""
NMS_IOU = 0.45
"""TPH-YOLOv5's default."""
_LARGEST_LOG = 4.0
_MAX_CANDIDATES = 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Boxes found in an image, the most confident first.

    ``centres_px`` and ``sizes_px`` are (n, 2) in pixel edges: the left edge of the image is 0,
    the right edge its width.  ``logits`` are (n,), of being a marker.
    """

    centres_px: Array
    sizes_px: Array
    logits: Array


@functools.lru_cache(maxsize=8)
def cells_of(width: int, height: int) -> Array:
    """Return centre x, centre y and stride of all cells, shape (3, cells), in pixel edges."""
    columns, rows = -(-width // 4), -(-height // 4)
    parts = []
    for stride in STRIDES:
        x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        parts.append(np.stack([x * stride, y * stride, np.full_like(x, stride)]).reshape(3, -1))
        columns, rows = -(-columns // 2), -(-rows // 2)
    cells = np.concatenate(parts, 1).astype(np.float32)
    cells.flags.writeable = False
    return cells


def decode(raw: Array, width: int, height: int, min_logit: float) -> Boxes:
    """Return the boxes in the network's answer (5, cells), without duplicates."""
    candidates = np.flatnonzero(raw[4] > min_logit)
    order = np.argsort(-raw[4, candidates], kind="stable")[:_MAX_CANDIDATES]
    chosen = candidates[order]
    x, y, stride = cells_of(width, height)[:, chosen]
    shift = raw[:4, chosen]
    centres = np.stack([x + shift[0] * stride, y + shift[1] * stride], 1)
    sizes = BASE_CELLS * stride[:, None] * np.exp(np.clip(shift[2:], -_LARGEST_LOG, _LARGEST_LOG).T)
    first = suppress(centres, sizes)
    return Boxes(centres_px=centres[first], sizes_px=sizes[first], logits=raw[4, chosen][first])


def joint_logit(a: float, b: float) -> float:
    """Return the logit of the product of two probabilities given as logits."""
    # p / (1 - p) of the product is 1 / (e^-a + e^-b + e^-(a + b)).
    return float(-np.logaddexp(np.logaddexp(-a, -b), -(a + b)))


def class_logit(answer: Array) -> tuple[int, float]:
    """Return the likeliest class of the second network's answer (ids + 1,) and its logit.

    The last number is that of "another id, or no marker", which is never returned.
    """
    best = int(answer[:-1].argmax())
    others = np.delete(answer.astype(np.float64), best)
    return best, float(answer[best] - np.logaddexp.reduce(others))


def suppress(centres: Array, sizes: Array, limit: float = NMS_IOU) -> list[int]:
    """Return the indices of boxes (n, 2), best first, that overlap no better box too much."""
    doubles = iou(centres, sizes) > limit
    kept: list[int] = []
    for index in range(len(centres)):
        if not doubles[index, kept].any():
            kept.append(index)
    return kept


def iou(centres: Array, sizes: Array) -> Array:
    """Return the intersection of any two boxes over their union, shape (n, n)."""
    low, high = centres - sizes / 2, centres + sizes / 2
    sides = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    common = np.maximum(sides, 0.0).prod(axis=2)
    areas = sizes.prod(axis=1)
    union = areas[:, None] + areas[None] - common
    result: Array = np.divide(common, union, out=np.zeros_like(common), where=union > 0)
    return result
