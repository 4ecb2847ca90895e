"""Pictures of the decoys, painted on the ground before the marker."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.placed import Decoy
from pytest_garl.simulation.camera.canvas import BLACK_LEVEL, WHITE_LEVEL, Canvas, marker_bits

_CELLS = 168
_GROUND = -1.0
"""Where a pattern leaves the ground as it is."""
_QR_CELLS = 21
"""A QR code of version 1 (ISO/IEC 18004)."""
Pattern = NDArray[np.float32]


def paint_decoy(canvas: Canvas, decoy: Decoy) -> None:
    """Paint a decoy; at zero yaw its top is north."""
    if decoy.kind == "other-id":
        # As the marker, with its margin.
        canvas.marker(decoy.place_m, decoy.side_m, decoy.yaw_rad, decoy.id, decoy.dictionary)
        return
    pattern = _pattern(decoy.kind, decoy.id, decoy.dictionary)
    reach, (x_min, _, _, y_max) = decoy.side_m / math.sqrt(2), canvas.bounds_m
    x, y = decoy.place_m
    height, width = canvas.image.shape[:2]
    left, right, top, bottom = (
        min(most, max(0, math.floor(each / canvas.m_per_px)))
        for each, most in (
            (x - reach - x_min, width),
            (x + reach - x_min + canvas.m_per_px, width),
            (y_max - y - reach, height),
            (y_max - y + reach + canvas.m_per_px, height),
        )
    )
    if right <= left or bottom <= top:
        return
    east = x_min + (np.arange(left, right) + 0.5) * canvas.m_per_px - x
    north = (y_max - (np.arange(top, bottom) + 0.5) * canvas.m_per_px - y)[:, None]
    cos, sin = math.cos(decoy.yaw_rad), math.sin(decoy.yaw_rad)
    across = (cos * east + sin * north) / decoy.side_m + 0.5
    down = 0.5 - (cos * north - sin * east) / decoy.side_m
    inside = (across >= 0) & (across < 1) & (down >= 0) & (down < 1)
    column = np.clip((across * _CELLS).astype(np.intp), 0, _CELLS - 1)
    row = np.clip((down * _CELLS).astype(np.intp), 0, _CELLS - 1)
    levels = pattern[row, column]
    drawn = inside & (levels != _GROUND)
    canvas.image[top:bottom, left:right][drawn] = levels[drawn][:, None].astype(np.uint8)


@functools.lru_cache(maxsize=64)
def _pattern(kind: str, marker_id: int, dictionary: str) -> Pattern:
    """Return the grey levels of a decoy, row by row from its top left."""
    if kind == "same-id-without-margin":
        return _enlarged(marker_bits(marker_id, dictionary))
    if kind == "chequered-mat":
        return _enlarged(np.indices((8, 8)).sum(axis=0) % 2 == 0)
    if kind == "qr-code":
        return _enlarged(_qr_cells())
    row, column = (np.indices((_CELLS, _CELLS)) + 0.5) / _CELLS
    if kind == "helipad-h":
        return _helipad(column - 0.5, row - 0.5)
    if kind == "grate":
        # Slots between bars in a light frame.
        slots = (np.floor(column * 14) % 2 == 1) & (np.abs(row - 0.5) < 0.4)
        slots &= np.abs(column - 0.5) < 0.43
        slots &= np.abs(row - 0.5) > 0.03
        return _levels(~slots, WHITE_LEVEL * 0.6)
    # A window: dark panes, two by two, in a white frame.
    middle = np.minimum(np.abs(column - 0.5), np.abs(row - 0.5)) < 0.04
    edge = np.maximum(np.abs(column - 0.5), np.abs(row - 0.5)) > 0.42
    return _levels(middle | edge, WHITE_LEVEL)


def _helipad(x: NDArray[np.float64], y: NDArray[np.float64]) -> Pattern:
    """Return a white H in a white ring; the H is as wide and as bold as in ICAO Annex 14."""
    # 3 m high, 1.8 m wide, strokes of 0.4 m: here a height of half of the ring's diameter.
    unit, away = 0.5 / 3.0, np.hypot(x, y)
    posts = (np.abs(np.abs(x) - 0.7 * unit) < 0.2 * unit) & (np.abs(y) < 1.5 * unit)
    bar = (np.abs(x) < 0.7 * unit) & (np.abs(y) < 0.2 * unit)
    ring = (away < 0.5) & (away > 0.44)
    pattern = np.full(x.shape, _GROUND, np.float32)
    pattern[away < 0.5] = 90.0
    pattern[posts | bar | ring] = WHITE_LEVEL
    return pattern


def _qr_cells() -> NDArray[np.bool_]:
    """Return a code with its three finder patterns; what it says does not matter."""
    cells = np.random.default_rng(21).random((_QR_CELLS, _QR_CELLS)) < 0.5
    finder = np.ones((8, 8), np.bool_)
    finder[:7, :7] = False
    finder[1:6, 1:6] = True
    finder[2:5, 2:5] = False
    cells[:8, :8] = finder
    cells[:8, -8:] = finder[:, ::-1]
    cells[-8:, :8] = finder[::-1]
    # A margin of two modules.
    white: NDArray[np.bool_] = np.pad(cells, 2, constant_values=True)
    return white


def _enlarged(white: NDArray[np.bool_]) -> Pattern:
    index = np.arange(_CELLS) * len(white) // _CELLS
    return _levels(white[np.ix_(index, index)], WHITE_LEVEL)


def _levels(light: NDArray[np.bool_], level: float) -> Pattern:
    return np.where(light, np.float32(level), np.float32(BLACK_LEVEL))
