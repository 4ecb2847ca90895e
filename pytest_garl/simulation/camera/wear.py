"""Wear of a painted marker: patches in which the ground shows instead of the paint."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Pad, PlacedMarker
from pytest_garl.simulation.camera.canvas import Canvas
from pytest_garl.simulation.randomness import generator

_CELLS = 192
"""Cells along a marker's side: 8 mm for the paper's."""
_LARGEST, _SMALLEST = 0.25, 0.02
"""Wavelengths of the pattern as shares of the side: from two modules, so that no side of the marker
is spared, to the ragged edges of patches; engineering estimate from the photographic standards of
ASTM D913, in which film comes off in patches, down to the substrate."""
_SPECTRUM = 3.0
"""Exponent of the pattern's power: patches of all sizes, the large ones first."""


def wear(canvas: Canvas, pad: Pad, map: Map) -> None:
    """Bare the ground in the worn patches of all markers of a pad."""
    if pad.worn_share <= 0:
        return
    for index, marker in enumerate(pad.markers):
        rows, columns = _box(canvas, marker)
        part = canvas.image[rows, columns]
        if not part.size:
            continue
        x = canvas.bounds_m[0] + (np.arange(columns.start, columns.stop) + 0.5) * canvas.m_per_px
        y = canvas.bounds_m[3] - (np.arange(rows.start, rows.stop) + 0.5) * canvas.m_per_px
        east, north = x - marker.place_m[0], (y - marker.place_m[1])[:, None]
        cos, sin = math.cos(marker.yaw_rad), math.sin(marker.yaw_rad)
        across = (cos * east + sin * north) / marker.side_m + 0.5
        down = 0.5 - (cos * north - sin * east) / marker.side_m
        inside = (across >= 0) & (across < 1) & (down >= 0) & (down < 1)
        column = np.clip((across * _CELLS).astype(np.intp), 0, _CELLS - 1)
        row = np.clip((down * _CELLS).astype(np.intp), 0, _CELLS - 1)
        worn = inside & (_ranks(pad.seed, index)[row, column] <= pad.worn_share)
        part[worn] = map.ground.colour


def _box(canvas: Canvas, marker: PlacedMarker) -> tuple[slice, slice]:
    """Return the rows and columns of the canvas that hold a marker."""
    corners = np.array(marker.outline_m)
    (west, south), (east, north) = corners.min(axis=0), corners.max(axis=0)
    height, width = canvas.image.shape[:2]
    x_min, _, _, y_max = canvas.bounds_m

    def span(low: float, high: float, most: int) -> slice:
        start = min(most, max(0, math.floor(low / canvas.m_per_px)))
        return slice(start, max(start, min(most, math.ceil(high / canvas.m_per_px))))

    return span(y_max - north, y_max - south, height), span(west - x_min, east - x_min, width)


@functools.lru_cache(maxsize=32)
def _ranks(seed: int, index: int) -> NDArray[np.float32]:
    """Return the order (0 to 1) in which the cells of a marker wear off."""
    noise = generator(seed, "wear", index).standard_normal((_CELLS, _CELLS))
    wave = np.hypot(np.fft.fftfreq(_CELLS)[:, None], np.fft.rfftfreq(_CELLS)) * _CELLS
    amplitude = np.zeros_like(wave)
    kept = (wave >= 1 / _LARGEST) & (wave <= 1 / _SMALLEST)
    amplitude[kept] = wave[kept] ** (-_SPECTRUM / 2)
    field = np.fft.irfft2(np.fft.rfft2(noise) * amplitude, (_CELLS, _CELLS))
    order = np.argsort(field, axis=None, kind="stable")
    ranks = np.empty(field.size, np.float32)
    ranks[order] = (np.arange(field.size) + 1) / field.size
    return ranks.reshape(field.shape)
