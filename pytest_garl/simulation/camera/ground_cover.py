"""Leaves and snow that lie on the ground, as a pattern that repeats every 8 m."""

from __future__ import annotations

import functools
import math

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.simulation.camera.canvas import Bounds, Image
from pytest_garl.simulation.camera.weather import Conditions

TILE_M = 8.0
_CELL_M = 0.01


@functools.cache
def _tiles() -> tuple[NDArray[np.float32], Image, NDArray[np.float32]]:
    """Ranks in [0, 1] and colours of fallen leaves, and ranks of snow, on a tile of 8 m.

    A place is covered when its rank is below the cover gene, so that a gene of 0.1 covers
    a tenth of the ground and a larger gene covers the same places and more.
    """
    size = round(TILE_M / _CELL_M)
    rng = np.random.default_rng(7)
    order = np.full((size, size), 0, np.int32)
    colours = np.zeros((size, size, 3), np.uint8)
    palette = np.array([[176, 92, 28], [198, 132, 40], [150, 58, 32], [122, 88, 46]])
    count = 24000
    for index in range(count, 0, -1):
        outline = _leaf_outline(rng) + rng.uniform(0, size, 2)
        points = np.round(outline).astype(np.int32)
        colour = palette[rng.integers(len(palette))] + rng.normal(0, 10, 3)
        tint = tuple(float(value) for value in np.clip(colour, 0, 255))
        cv2.fillPoly(order, [points], index)
        cv2.fillPoly(colours, [points], tint)
    order[order == 0] = count + 1
    noise = np.zeros((size, size), np.float32)
    for amplitude, step in ((1.0, 80), (0.7, 25), (0.5, 8), (0.25, 3)):
        cells = size // step
        small = rng.standard_normal((cells, cells)).astype(np.float32)
        wrapped = np.pad(small, 2, mode="wrap")
        big = cv2.resize(wrapped, ((cells + 4) * step,) * 2, interpolation=cv2.INTER_CUBIC).astype(
            np.float32
        )
        noise += amplitude * cv2.resize(
            big[2 * step : -2 * step, 2 * step : -2 * step], (size, size)
        )
    return _ranks(order.astype(np.float32)), colours, _ranks(noise)


def _leaf_outline(rng: np.random.Generator) -> NDArray[np.float64]:
    """Five-lobed outline, 8 to 15 cm across as maple leaves are, in tile pixels."""
    angles = np.linspace(0, 2 * math.pi, 20, endpoint=False)
    lobes = 0.72 + 0.28 * np.cos(5 * angles)
    radius = rng.uniform(0.04, 0.075) / _CELL_M * lobes
    turn = rng.uniform(0, 2 * math.pi)
    return np.column_stack([radius * np.cos(angles + turn), radius * np.sin(angles + turn)])


def _ranks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    flat = values.ravel()
    ordered = np.sort(flat)
    share = np.searchsorted(ordered, flat, side="right") / flat.size
    return share.reshape(values.shape).astype(np.float32)


def cover_shift(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw where the pattern begins in the world, shape (2,): the first draw for a camera."""
    return rng.uniform(0, TILE_M, 2)


def cover(
    image: Image,
    bounds_m: Bounds,
    resolution: float,
    shift_m: NDArray[np.float64],
    conditions: Conditions,
) -> None:
    """Lay leaves and snow over the image of a piece of ground, in place."""
    if conditions.leaf_cover <= 0 and conditions.snow_cover <= 0:
        return
    leaves, colours, snow = _tiles()
    size = leaves.shape[0]
    rows, columns = image.shape[:2]
    x = ((bounds_m[0] - shift_m[0] + (np.arange(columns) + 0.5) * resolution) / _CELL_M).astype(
        int
    ) % size
    y = ((shift_m[1] - bounds_m[3] + (np.arange(rows) + 0.5) * resolution) / _CELL_M).astype(
        int
    ) % size
    grid = np.ix_(y, x)
    if conditions.leaf_cover > 0:
        here = leaves[grid] <= conditions.leaf_cover
        image[here] = colours[grid][here]
    if conditions.snow_cover > 0:
        image[snow[grid] <= conditions.snow_cover] = (236, 240, 246)


def covered(
    places_m: NDArray[np.float64], shift_m: NDArray[np.float64], conditions: Conditions
) -> NDArray[np.bool_]:
    """Whether places (n, 2) lie under leaves or snow; ``shift_m`` is the ground's, shape (n,)."""
    leaves, _, snow = _tiles()
    size = leaves.shape[0]
    column = ((places_m[:, 0] - shift_m[0]) / _CELL_M).astype(int) % size
    row = ((shift_m[1] - places_m[:, 1]) / _CELL_M).astype(int) % size
    under = np.zeros(len(places_m), np.bool_)
    if conditions.leaf_cover > 0:
        under |= leaves[row, column] <= conditions.leaf_cover
    if conditions.snow_cover > 0:
        under |= snow[row, column] <= conditions.snow_cover
    return under
