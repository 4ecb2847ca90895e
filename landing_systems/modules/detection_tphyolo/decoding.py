"""From the network's numbers to boxes: cells, sizes, confidence, non-maximum suppression."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
CLASS_IDS = (0, 1, 2, 3)
"""The ids that are told apart, as in the paper's published detector (marker0 to marker3); a
marker of another id belongs to no class and is not reported."""
STRIDES = (4, 8, 16, 32)
CHANNELS = 5 + len(CLASS_IDS)
"""Centre x and y, logarithms of width and height, objectness, one logit per class."""
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
    the right edge its width.  ``logits`` are (n,), of the class in ``classes`` (n,).
    """

    centres_px: Array
    sizes_px: Array
    logits: Array
    classes: NDArray[np.intp]


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
    """Return the boxes in the network's answer (5 + ids, cells), without duplicates.

    The logit of a box is that of objectness times class: both are sigmoids, and the product's
    logit is what calibration takes.
    """
    objects, ids = raw[4], raw[5:]
    # A product of two probabilities is below either, so this cannot lose a candidate.
    candidates = np.flatnonzero(objects > min_logit)
    if len(candidates) > _MAX_CANDIDATES:
        best = np.argsort(-objects[candidates], kind="stable")[:_MAX_CANDIDATES]
        candidates = candidates[best]
    classes = ids[:, candidates].argmax(axis=0)
    logits = joint_logit(objects[candidates], ids[classes, candidates])
    keep = np.flatnonzero(logits > min_logit)
    order = keep[np.argsort(-logits[keep], kind="stable")]
    chosen = candidates[order]
    x, y, stride = cells_of(width, height)[:, chosen]
    shift = raw[:4, chosen]
    centres = np.stack([x + shift[0] * stride, y + shift[1] * stride], 1)
    sizes = BASE_CELLS * stride[:, None] * np.exp(np.clip(shift[2:], -_LARGEST_LOG, _LARGEST_LOG).T)
    first = suppress(centres, sizes)
    return Boxes(
        centres_px=centres[first],
        sizes_px=sizes[first],
        logits=logits[order][first],
        classes=classes[order][first],
    )


def joint_logit(a: Array, b: Array) -> Array:
    """Return the logit of the product of two probabilities given as logits."""
    # p/(1-p) of the product is 1 / (e^-a + e^-b + e^-(a+b)).
    result: Array = -np.logaddexp(np.logaddexp(-a, -b), -(a + b))
    return result


def suppress(centres: Array, sizes: Array, limit: float = NMS_IOU) -> list[int]:
    """Return the indices of boxes (n, 2), best first, that overlap no better box too much."""
    kept: list[int] = []
    for index in range(len(centres)):
        if all(iou(centres, sizes, index, other) <= limit for other in kept):
            kept.append(index)
    return kept


def iou(centres: Array, sizes: Array, a: int, b: int) -> float:
    """Intersection of two of the boxes over their union."""
    low = np.maximum(centres[a] - sizes[a] / 2, centres[b] - sizes[b] / 2)
    high = np.minimum(centres[a] + sizes[a] / 2, centres[b] + sizes[b] / 2)
    common = float(np.prod(np.maximum(high - low, 0.0)))
    union = float(sizes[a].prod() + sizes[b].prod()) - common
    return common / union if union > 0 else 0.0
