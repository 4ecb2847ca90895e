"""A confidence that is a probability: Platt scaling of logits, and how well it holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_STEPS = 50
_RIDGE = 1e-3
"""Keeps the slope finite where right and wrong do not overlap."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bin:
    """Detections of about one confidence: how many, their mean confidence, how many are right."""

    count: int
    confidence: float
    right: float


def fit(logits: Sequence[float], right: Sequence[bool]) -> tuple[float, float]:
    """Return slope and offset with which sigmoid(slope x logit + offset) is most likely.

    Platt (1999), with his targets that are a little inside 0 and 1, by Newton's method.
    Raises ValueError where all are right or all are wrong.
    """
    x, y = np.asarray(logits, np.float64), np.asarray(right, np.float64)
    positive, negative = float(y.sum()), float((1 - y).sum())
    if min(positive, negative) == 0:
        raise ValueError(
            f"calibration: found {positive:.0f} right and {negative:.0f} wrong detections, "
            "expected some of both; calibrate on more pictures"
        )
    target = np.where(y > 0, (positive + 1) / (positive + 2), 1 / (negative + 2))
    columns = np.column_stack([x, np.ones_like(x)])
    solution = np.array([1.0, 0.0])
    for _ in range(_STEPS):
        chance = _sigmoid(columns @ solution)
        slope = columns.T @ (chance - target) + _RIDGE * (solution - [1.0, 0.0])
        bend = (columns * (chance * (1 - chance))[:, None]).T @ columns + _RIDGE * np.eye(2)
        step = np.linalg.solve(bend, slope)
        # Newton's steps overshoot far from the minimum: bounded, they do not.
        solution = solution - step / max(1.0, float(np.abs(step).max()))
        if np.abs(step).max() < 1e-9:
            break
    return max(float(solution[0]), 1e-3), float(solution[1])


def reliability(
    confidences: Sequence[float], right: Sequence[bool], bins: int = 10
) -> tuple[Bin, ...]:
    """Return the bins of a reliability diagram, equally wide, without the empty ones."""
    x, y = np.asarray(confidences, np.float64), np.asarray(right, np.float64)
    owners = np.minimum((x * bins).astype(int), bins - 1)
    return tuple(
        Bin(
            count=int((owners == index).sum()),
            confidence=float(x[owners == index].mean()),
            right=float(y[owners == index].mean()),
        )
        for index in range(bins)
        if (owners == index).any()
    )


def calibration_error(bins: Sequence[Bin]) -> float:
    """Return the expected calibration error: |confidence - share of right|, by count."""
    total = sum(each.count for each in bins)
    errors = (each.count * abs(each.confidence - each.right) for each in bins)
    return math.fsum(errors) / max(1, total)


def _sigmoid(x: Array) -> Array:
    result: Array = 1 / (1 + np.exp(-np.clip(x, -60, 60)))
    return result
