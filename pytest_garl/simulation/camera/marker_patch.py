"""The marker as it lies on the ground: the grey of each of its places, before air and sensor."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placement import MARKER_SIDE_M
from pytest_garl.simulation.camera.canvas import (
    BLACK_LEVEL,
    MARKER_CELLS,
    WHITE_LEVEL,
    Canvas,
    marker_bits,
)
from pytest_garl.simulation.camera.ground import shadowed
from pytest_garl.simulation.camera.ground_cover import cover
from pytest_garl.simulation.camera.weather import WET_ALBEDO_LOSS, Conditions

Array = NDArray[np.float32]
MODULE_M = MARKER_SIDE_M / MARKER_CELLS
BOARD_MODULES = MARKER_CELLS + 2
"""The marker and a white margin of one module on each side."""
PROBES_PER_MODULE = 3
PROBES = BOARD_MODULES * PROBES_PER_MODULE
_PX_PER_PROBE = 8
"""The patch is painted at about the resolution of the ground, 0.01 m, before it is averaged."""
GREY = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in a grey level (ITU-R BT.601), as detectors compute it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerPatch:
    """Places on the marker's board, three by three per module, row by row from the north-west.

    ``places_m`` (n, 2) are in the world; ``light`` (n,) is the share of full light that static
    bodies let through; ``albedo`` (n,) the grey level in full light with what lies on the board;
    ``white_level`` and ``black_level`` those of bare modules.
    """

    places_m: NDArray[np.float64]
    light: Array
    albedo: Array
    white_level: float
    black_level: float


@functools.cache
def modules(marker_id: int) -> NDArray[np.bool_]:
    """Return which modules (9, 9) of a marker's board are white."""
    return np.pad(marker_bits(marker_id), 1, constant_values=True)


def paint_patch(
    marker_m: tuple[float, float],
    map: Map,
    conditions: Conditions,
    cover_shift_m: NDArray[np.float64],
    marker_id: int,
) -> MarkerPatch:
    """Paint the board as ``paint_ground`` does, without the ground about it."""
    half = MODULE_M * BOARD_MODULES / 2
    x, y = marker_m
    bounds, size = (x - half, x + half, y - half, y + half), PROBES * _PX_PER_PROBE
    step = 2 * half / size
    canvas = Canvas(np.zeros((size, size, 3), np.uint8), bounds, step)
    canvas.marker(marker_m, MARKER_SIDE_M, 0.0, marker_id)
    dry = 1 - WET_ALBEDO_LOSS * conditions.wetness
    cv2.convertScaleAbs(canvas.image, canvas.image, dry)
    cover(canvas.image, bounds, step, cover_shift_m, conditions)
    full = Canvas(np.full((size, size), 255, np.uint8), bounds, step)
    light = _averaged(shadowed(full, map, conditions)) / np.float32(255)
    along = (np.arange(PROBES) + 0.5) / PROBES * 2 * half - half
    across, down = np.meshgrid(x + along, y - along)
    return MarkerPatch(
        places_m=np.column_stack([across.ravel(), down.ravel()]),
        light=light.ravel(),
        albedo=(_averaged(canvas.image) @ GREY).ravel(),
        white_level=dry * WHITE_LEVEL,
        black_level=dry * BLACK_LEVEL,
    )


def _averaged(image: NDArray[np.uint8]) -> Array:
    small = cv2.resize(image, (PROBES, PROBES), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)
