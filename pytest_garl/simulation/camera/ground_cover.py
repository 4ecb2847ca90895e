"""Leaves and snow that lie on the ground, as patterns that repeat every 8 m and every 16 m."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.simulation.camera.canvas import Bounds, Image
from pytest_garl.simulation.camera.weather import Conditions

TILE_M = 8.0
_SNOW_TILE_M = 16.0
"""Snow depth varies most over 7 to 45 m (Trujillo et al. 2007)."""
_CELL_M = 0.01
_SNOW_COLOUR = np.array([236, 240, 246], np.float32)
_SNOW_SPECTRUM = 4.0
"""Below 7 m, the mean two-dimensional power spectrum of snow depth falls with an exponent of 4.0 to
4.5 (Trujillo et al. 2007, lidar of five areas of 1 km2); the lower one gives the roughest edges."""
_HALF_OPAQUE_M = 0.01
"""Depth at which half of the light is reflected by the snow: d / (d + h) with h of 7 mm for fresh
snow (grains of 0.1 mm, 100 kg/m3) and 12 mm for melting snow (0.5 mm, 300 kg/m3), from two streams
without absorption and the asymmetry 0.89 of Wiscombe and Warren (1980)."""
_SPREAD_PER_M = math.pi / 0.2
"""Light that scatters through snow also goes sideways: after a depth d a pattern of stripes 0.2 m
wide, as the modules of a marker are, has q d / sinh(q d) of the contrast that is left to an even
light, with q = pi / 0.2 m (diffusion without absorption through a layer, decomposed into waves)."""
_EDGE_SLOPE = 0.3
"""Slope of the snow's surface, root mean square: bare ground warms the air, which melts a patch
from its edges (Liston 1995), so that these are steeper than fallen snow; engineering estimate."""
_LEVELS = 4096


@functools.cache
def _leaves() -> tuple[NDArray[np.float32], Image]:
    """Ranks in [0, 1] and colours of fallen leaves on a tile.

    A place is covered when its rank is below the cover gene, so that a gene of 0.1 covers
    a tenth of the ground and a larger gene covers the same places and more.
    """
    size = round(TILE_M / _CELL_M)
    rng = np.random.default_rng(7)
    order = np.zeros((size, size), np.int32)
    palette = np.array([[176, 92, 28], [198, 132, 40], [150, 58, 32], [122, 88, 46]])
    count = 24000
    leaves = [_Leaf.drawn(rng, size, len(palette)) for _ in range(count)]
    tints = palette[[leaf.shade for leaf in leaves]] + np.array([leaf.tint for leaf in leaves])
    colours = np.vstack([np.zeros(3), np.clip(tints[::-1], 0, 255)])
    for index, outline in zip(range(count, 0, -1), _outlines(leaves), strict=True):
        cv2.fillPoly(order, [outline], index)
    image = np.rint(colours).astype(np.uint8)[order]
    order[order == 0] = count + 1
    shares = np.cumsum(np.bincount(order.ravel())) / order.size
    return shares.astype(np.float32)[order], image


@functools.cache
def _snow() -> tuple[NDArray[np.uint16], NDArray[np.float64]]:
    """Snow's depth on a tile: levels below ``_LEVELS``, and the depth in metres of each level.

    Depths are those above the mean: melting takes the same from all places, so that what is left
    are the deepest ones, and a patch has its edges where the depth has a contour.
    """
    size = round(_SNOW_TILE_M / _CELL_M) // 2
    rng = np.random.default_rng(8)
    wave = np.fft.fftfreq(size)[:, None] ** 2 + np.fft.rfftfreq(size) ** 2
    wave[0, 0] = np.inf
    # Power falls as the wave number to the exponent; the root of power is amplitude.
    spectrum = np.fft.rfft2(rng.standard_normal((size, size))) * wave ** (-_SNOW_SPECTRUM / 4)
    depth = np.fft.irfft2(spectrum, (size, size))
    along, across = (np.roll(depth, -1, axis) - depth for axis in (0, 1))
    slope = math.sqrt((along**2).mean() + (across**2).mean()) / (2 * _CELL_M)
    depth *= _EDGE_SLOPE / slope
    padded = np.pad(depth.astype(np.float32), 2, mode="wrap")
    fine = cv2.resize(padded, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)[4:-4, 4:-4]
    depths = np.linspace(float(fine.min()), float(fine.max()), _LEVELS)
    step = depths[1] - depths[0]
    return np.round((fine - depths[0]) / step).astype(np.uint16), depths


@functools.cache
def _snow_shares() -> NDArray[np.float64]:
    """Share of the tile that is deeper than each level."""
    levels, _ = _snow()
    counts = np.bincount(levels.ravel(), minlength=_LEVELS)
    shares: NDArray[np.float64] = 1 - np.cumsum(counts) / levels.size
    return shares


def _snow_opacity(share: float) -> NDArray[np.uint8]:
    """Return the opacity (0..255) of each level if a share of the ground is half opaque or more."""
    _, depths = _snow()
    if share >= 1:
        return np.full(_LEVELS, 255, np.uint8)
    # Shares fall with the level.
    edge = _LEVELS - int(np.searchsorted(_snow_shares()[::-1], share, side="right"))
    depth = np.maximum(depths - depths[min(edge, _LEVELS - 1)] + _HALF_OPAQUE_M, 0)
    spread = np.maximum(_SPREAD_PER_M * depth, 1e-9)
    through = _HALF_OPAQUE_M / (depth + _HALF_OPAQUE_M) * spread / np.sinh(spread)
    # No snow lies where the depth is 0.
    shown = np.where(depth > 0, 1 - through, 0.0)
    opacity: NDArray[np.uint8] = np.round(255 * shown).astype(np.uint8)
    return opacity


class _Leaf(NamedTuple):
    """Half its width in metres, its turn, its place in cells, its colour."""

    radius_m: float
    turn: float
    place: NDArray[np.float64]
    shade: int
    tint: NDArray[np.float64]

    @classmethod
    def drawn(cls, rng: np.random.Generator, size: int, shades: int) -> _Leaf:
        """Return a leaf 8 to 15 cm across, as maple leaves are, on a tile of ``size`` cells."""
        return cls(
            radius_m=rng.uniform(0.04, 0.075),
            turn=rng.uniform(0, 2 * math.pi),
            place=rng.uniform(0, size, 2),
            shade=int(rng.integers(shades)),
            tint=rng.normal(0, 10, 3),
        )


def _outlines(leaves: Sequence[_Leaf]) -> NDArray[np.int32]:
    """Return outlines with five lobes, in cells of the tile: shape (leaves, 20, 2)."""
    angles = np.linspace(0, 2 * math.pi, 20, endpoint=False)
    lobes = 0.72 + 0.28 * np.cos(5 * angles)
    radius = np.array([leaf.radius_m for leaf in leaves])[:, None] / _CELL_M * lobes
    turned = angles + np.array([leaf.turn for leaf in leaves])[:, None]
    outlines = np.stack([radius * np.cos(turned), radius * np.sin(turned)], axis=-1)
    places = np.array([leaf.place for leaf in leaves])[:, None]
    cells: NDArray[np.int32] = np.round(outlines + places).astype(np.int32)
    return cells


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
    """Lay leaves and snow over the image, (h, w, 3), of a piece of ground, in place.

    The pattern begins at ``shift_m``, (2,); ``resolution`` is in metres a pixel.
    """
    rows, columns = image.shape[:2]
    x = bounds_m[0] + (np.arange(columns) + 0.5) * resolution
    y = bounds_m[3] - (np.arange(rows) + 0.5) * resolution
    if conditions.leaf_cover > 0:
        ranks, colours = _leaves()
        grid = np.ix_(*_cells(x, y, shift_m, TILE_M))
        here = ranks[grid] <= conditions.leaf_cover
        image[here] = colours[grid][here]
    if conditions.snow_cover > 0:
        levels, _ = _snow()
        opacity = _snow_opacity(conditions.snow_cover)[levels]
        alpha = opacity[np.ix_(*_cells(x, y, shift_m, _SNOW_TILE_M))]
        white = alpha > 0
        share = alpha[white, None] / np.float32(255)
        image[white] = np.round(image[white] * (1 - share) + _SNOW_COLOUR * share)


def covered(
    places_m: NDArray[np.float64], shift_m: NDArray[np.float64], conditions: Conditions
) -> NDArray[np.bool_]:
    """Whether places (n, 2) lie under leaves or snow; ``shift_m`` is the ground's, shape (n,)."""
    x, y = places_m[:, 0], places_m[:, 1]
    under = np.zeros(len(places_m), np.bool_)
    if conditions.leaf_cover > 0:
        under |= _leaves()[0][_cells(x, y, shift_m, TILE_M)] <= conditions.leaf_cover
    if conditions.snow_cover > 0:
        opacity = _snow_opacity(conditions.snow_cover)[_snow()[0]]
        under |= opacity[_cells(x, y, shift_m, _SNOW_TILE_M)] > 127
    return under


def _cells(
    x: NDArray[np.floating], y: NDArray[np.floating], shift_m: NDArray[np.float64], tile_m: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of places on a tile; the shift is one of a tile of ``TILE_M``."""
    size = round(tile_m / _CELL_M)
    east, north = shift_m * (tile_m / TILE_M)
    column = ((x - east) / _CELL_M).astype(np.intp) % size
    row = ((north - y) / _CELL_M).astype(np.intp) % size
    return row, column
