"""The planar ground, painted once per flight: texture, lines, marker, cover, light, shadows."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Pad
from pytest_garl.simulation.camera import map_texture
from pytest_garl.simulation.camera.canvas import Bounds, Canvas, Image
from pytest_garl.simulation.camera.decoys import paint_decoy
from pytest_garl.simulation.camera.ground_cover import cover
from pytest_garl.simulation.camera.map_texture import RESOLUTION_M
from pytest_garl.simulation.camera.meshes import mesh_of, placed_hulls
from pytest_garl.simulation.camera.wear import wear
from pytest_garl.simulation.camera.weather import WET_ALBEDO_LOSS, Conditions

_INSET_M = 0.01
_INSET_HALF_M = 2.0
"""Resolution and half the side of the piece about the marker; both follow the user's board."""
_INSET_MARGIN_M = 0.25
_PX_PER_MODULE = 6
_MOST_INSET_PX = 1600
_LEVELS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Raster:
    """A picture of a piece of ground as a mip pyramid: ``levels[k]`` has 2^k m_per_px.

    Levels have four channels, of which the last is unused: they are warped faster so.

    Row 0 lies at ``y_max``, column 0 at ``x_min`` (pixel edges, in metres).
    """

    levels: tuple[Image, ...]
    m_per_px: float
    x_min: float
    y_max: float

    @functools.cached_property
    def outline(self) -> NDArray[np.float64]:
        """Corners (4, 2) in the world."""
        rows, columns = self.levels[0].shape[:2]
        x, y = self.x_min + columns * self.m_per_px, self.y_max - rows * self.m_per_px
        return np.array([[self.x_min, self.y_max], [x, self.y_max], [x, y], [self.x_min, y]])

    def pixel_of_world(self, level: int) -> NDArray[np.float64]:
        """Matrix (3, 3) from homogeneous world (x, y) to pixel centres of a level."""
        scale = 1 / (self.m_per_px * 2**level)
        return np.array(
            [
                [scale, 0.0, -self.x_min * scale - 0.5],
                [0.0, -scale, self.y_max * scale - 0.5],
                [0.0, 0.0, 1.0],
            ]
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaintedGround:
    """The whole ground coarsely, and a piece about the marker finely.

    ``cover_shift_m`` (2,) says where the pattern of fallen leaves and snow begins; ``unlit``
    are both pieces without the shadows of static bodies.
    """

    wide: Raster
    inset: Raster
    cover_shift_m: NDArray[np.float64]
    unlit: tuple[Canvas, Canvas]


def paint_ground(
    map: Map,
    conditions: Conditions,
    shift: NDArray[np.float64],
    pad: Pad,
) -> PaintedGround:
    """Paint the ground of one flight in full light; exposure comes later.

    ``shift``, (2,) in metres, is where the pattern of fallen leaves and snow begins, as of
    ``cover_shift``.
    """
    return _lit(_painted(pad, map, conditions, shift), map, conditions, shift)


def repaint(
    ground: PaintedGround,
    pad: Pad,
    map: Map,
    before: Conditions,
    conditions: Conditions,
) -> PaintedGround:
    """Return the ground under other conditions than ``before``, as if painted under them.

    What lies on it costs five times as much as its shadows, so that it is painted anew only
    where it has changed.
    """
    if _light_of(conditions) == _light_of(before) and _cover_of(conditions) == _cover_of(before):
        return ground
    unlit, shift = ground.unlit, ground.cover_shift_m
    if _cover_of(conditions) != _cover_of(before):
        unlit = _painted(pad, map, conditions, shift)
    return _lit(unlit, map, conditions, shift)


def _cover_of(conditions: Conditions) -> tuple[float, ...]:
    return conditions.wetness, conditions.leaf_cover, conditions.snow_cover


def _light_of(conditions: Conditions) -> tuple[float, ...]:
    return *conditions.sun, conditions.direct_share


def _painted(
    pad: Pad,
    map: Map,
    conditions: Conditions,
    shift: NDArray[np.float64],
) -> tuple[Canvas, Canvas]:
    """Paint both pieces, with the marker and what lies about."""
    half, resolution = _inset_of(pad)
    x, y = pad.place_m
    inset_box = (x - half, x + half, y - half, y + half)
    wide = Canvas(map_texture.picture(map).copy(), map_texture.bounds_of(map), RESOLUTION_M)
    inset = Canvas(map_texture.detail(map, inset_box, resolution), inset_box, resolution)
    for canvas in (wide, inset):
        for decoy in pad.decoys:
            paint_decoy(canvas, decoy)
        canvas.board(pad)
        wear(canvas, pad, map)
        canvas.tarpaulin(pad)
        if conditions.wetness > 0:
            alpha = 1 - WET_ALBEDO_LOSS * conditions.wetness
            cv2.convertScaleAbs(canvas.image, canvas.image, alpha)
        cover(canvas.image, canvas.bounds_m, canvas.m_per_px, shift, conditions)
    return wide, inset


def _inset_of(pad: Pad) -> tuple[float, float]:
    """Return half the side, and the resolution, of the piece that holds the pad finely."""
    half = max(_INSET_HALF_M, pad.spec.reach_m + _INSET_MARGIN_M)
    module_m = min(each.side_m for each in pad.markers) / pad.spec.modules
    resolution = max(min(_INSET_M, module_m / _PX_PER_MODULE), 2 * half / _MOST_INSET_PX)
    # A whole number of pixels.
    return half, 2 * half / math.ceil(2 * half / resolution - 1e-9)


def _lit(
    unlit: tuple[Canvas, Canvas],
    map: Map,
    conditions: Conditions,
    shift: NDArray[np.float64],
) -> PaintedGround:
    wide, inset = (
        _raster(shadowed(canvas, map, conditions), canvas.bounds_m, canvas.m_per_px)
        for canvas in unlit
    )
    return PaintedGround(wide=wide, inset=inset, cover_shift_m=shift, unlit=unlit)


def _raster(image: Image, bounds_m: Bounds, resolution: float) -> Raster:
    levels = [np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA), dtype=np.uint8)]
    for _ in range(_LEVELS - 1):
        rows, columns = levels[-1].shape[:2]
        size = (max(1, columns // 2), max(1, rows // 2))
        levels.append(cv2.resize(levels[-1], size, interpolation=cv2.INTER_AREA).astype(np.uint8))
    return Raster(levels=tuple(levels), m_per_px=resolution, x_min=bounds_m[0], y_max=bounds_m[3])


def shadowed(canvas: Canvas, map: Map, conditions: Conditions) -> Image:
    """Return the piece, darker where the static bodies keep the sun from it."""
    if conditions.direct_share <= 0.01 or conditions.sun[2] <= 0.02:
        return canvas.image
    image = canvas.image.copy()
    mask = np.zeros(image.shape[:2], np.uint8)
    shade = Canvas(mask, canvas.bounds_m, canvas.m_per_px)
    for body in map.bodies:
        for hull in placed_hulls(mesh_of(body.parts), body.position_m, body.yaw_rad):
            outline = cv2.convexHull(shadow_of(hull, conditions.sun).astype(np.float32))
            shade.polygon(outline.reshape(-1, 2).astype(np.float64), (255.0,))
    if mask.any():
        dark = cv2.convertScaleAbs(image, alpha=1 - conditions.direct_share)
        cv2.copyTo(dark, mask, image)
    return image


def shadow_of(points: NDArray[np.float32], sun: tuple[float, float, float]) -> NDArray[np.float32]:
    """Project points (n, 3) along the sun's rays onto the ground; returns (n, 2)."""
    slope = np.array([sun[0], sun[1]], np.float32) / np.float32(sun[2])
    shadow: NDArray[np.float32] = points[:, :2] - points[:, 2:3] * slope
    return shadow
