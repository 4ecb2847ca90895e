"""The planar ground, painted once per flight: texture, lines, marker, cover, light, shadows."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps import Layer, Map
from pytest_garl.scenarios.placement import MARKER_SIDE_M, TARGET_MARKER_ID, marker_position_m
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.meshes import mesh_of, placed_hulls
from pytest_garl.simulation.weather import WET_ALBEDO_LOSS, Conditions

Image = NDArray[np.uint8]
_MARGIN_M = 15.0
_WIDE_M = 0.04
_INSET_M = 0.01
_INSET_HALF_M = 2.0
_LEVELS = 6
_TILE_M = 8.0
_CELLS = 7
"""A DICT_5X5 marker has five data cells and a black border of one on each side."""
_SHIFT = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Raster:
    """A picture of a piece of ground as a mip pyramid: ``levels[k]`` has 2^k m_per_px.

    Levels have four channels, of which the last is unused: they are warped faster so.

    Row 0 lies at ``y_max``, column 0 at ``x_min`` (pixel edges).
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

    def holds(self, points: NDArray[np.float64]) -> bool:
        """Whether homogeneous world points (3, n) of equal sign all lie well inside."""
        places = points[:2] / points[2]
        slack = 4 * self.m_per_px * 2 ** len(self.levels)
        low, high = self.outline.min(axis=0) + slack, self.outline.max(axis=0) - slack
        inside = (places >= low[:, None]) & (places <= high[:, None])
        return bool(inside.all())

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
class Ground:
    """The whole ground coarsely, and a piece about the marker finely.

    ``cover_shift_m`` (2,) says where the pattern of fallen leaves and snow begins; ``unlit``
    are both pieces without the shadows of static bodies.
    """

    wide: Raster
    inset: Raster
    cover_shift_m: NDArray[np.float64]
    unlit: tuple[_Canvas, _Canvas]


def paint_ground(
    scenario: Scenario,
    map: Map,
    conditions: Conditions,
    rng: np.random.Generator,
    marker_id: int = TARGET_MARKER_ID,
) -> Ground:
    """Paint the ground of one flight in full light; exposure comes later."""
    shift = rng.uniform(0, _TILE_M, 2)
    marker = marker_position_m(scenario, map)
    return _lit(_painted(marker, map, conditions, shift, marker_id), map, conditions, shift)


def repaint(
    ground: Ground,
    marker_m: tuple[float, float],
    map: Map,
    before: Conditions,
    conditions: Conditions,
    marker_id: int,
) -> Ground:
    """Return the ground under other conditions than ``before``, as if painted under them.

    What lies on it costs five times as much as its shadows, so that it is painted anew only
    where it has changed.
    """
    if _light_of(conditions) == _light_of(before) and _cover_of(conditions) == _cover_of(before):
        return ground
    unlit, shift = ground.unlit, ground.cover_shift_m
    if _cover_of(conditions) != _cover_of(before):
        unlit = _painted(marker_m, map, conditions, shift, marker_id)
    return _lit(unlit, map, conditions, shift)


def _cover_of(conditions: Conditions) -> tuple[float, ...]:
    return conditions.wetness, conditions.leaf_cover, conditions.snow_cover


def _light_of(conditions: Conditions) -> tuple[float, ...]:
    return *conditions.sun, conditions.direct_share


def _painted(
    marker: tuple[float, float],
    map: Map,
    conditions: Conditions,
    shift: NDArray[np.float64],
    marker_id: int,
) -> tuple[_Canvas, _Canvas]:
    """Paint both pieces, with the marker and what lies about."""
    x_min, x_max, y_min, y_max = map.bounds_m
    wide_box = (x_min - _MARGIN_M, x_max + _MARGIN_M, y_min - _MARGIN_M, y_max + _MARGIN_M)
    half = _INSET_HALF_M
    inset_box = (marker[0] - half, marker[0] + half, marker[1] - half, marker[1] + half)
    painted = _base(map)
    canvases = []
    for box, resolution in ((wide_box, _WIDE_M), (inset_box, _INSET_M)):
        if resolution == _WIDE_M:
            image = painted.copy()
        else:
            image = _detail(painted, wide_box, box, resolution, map)
        canvas = _Canvas(image, box, resolution)
        canvas.marker(marker, MARKER_SIDE_M, 0.0, marker_id)
        _wet(image, conditions.wetness)
        _cover(image, box, resolution, shift, conditions)
        canvases.append(canvas)
    return canvases[0], canvases[1]


def _lit(
    unlit: tuple[_Canvas, _Canvas],
    map: Map,
    conditions: Conditions,
    shift: NDArray[np.float64],
) -> Ground:
    wide, inset = (
        _raster(_light(canvas, map, conditions), canvas.box, canvas.resolution) for canvas in unlit
    )
    return Ground(wide=wide, inset=inset, cover_shift_m=shift, unlit=unlit)


def _raster(image: Image, box: tuple[float, float, float, float], resolution: float) -> Raster:
    levels = [np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA), dtype=np.uint8)]
    for _ in range(_LEVELS - 1):
        rows, columns = levels[-1].shape[:2]
        size = (max(1, columns // 2), max(1, rows // 2))
        levels.append(cv2.resize(levels[-1], size, interpolation=cv2.INTER_AREA).astype(np.uint8))
    return Raster(levels=tuple(levels), m_per_px=resolution, x_min=box[0], y_max=box[3])


class _Canvas:
    """Draws world shapes onto an image of a piece of ground."""

    def __init__(
        self, image: Image, box: tuple[float, float, float, float], resolution: float
    ) -> None:
        self.image, self.box, self.resolution = image, box, resolution

    def points(self, world: NDArray[np.float64]) -> NDArray[np.int32]:
        pixels = np.empty_like(world)
        pixels[:, 0] = (world[:, 0] - self.box[0]) / self.resolution - 0.5
        pixels[:, 1] = (self.box[3] - world[:, 1]) / self.resolution - 0.5
        fixed: NDArray[np.int32] = np.round(pixels * 2**_SHIFT).astype(np.int32)
        return fixed

    def polygon(self, world: NDArray[np.float64], colour: Sequence[float]) -> None:
        cv2.fillPoly(self.image, [self.points(world)], colour, cv2.LINE_AA, _SHIFT)

    def stroke(self, world: NDArray[np.float64], width_m: float, colour: Sequence[float]) -> None:
        for start, end in itertools.pairwise(world):
            along = end - start
            length = float(np.hypot(*along))
            if length > 0:
                side = np.array([-along[1], along[0]]) / length * width_m / 2
                self.polygon(np.array([start + side, end + side, end - side, start - side]), colour)

    def marker(
        self, centre: tuple[float, float], side_m: float, yaw_rad: float, marker_id: int
    ) -> None:
        """Print a marker on a white board with one cell of margin; its top is north at yaw 0."""
        bits = marker_bits(marker_id)
        cell = side_m / _CELLS
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        turn = np.array([[cos, -sin], [sin, cos]])

        def square(x: float, y: float, width: float) -> NDArray[np.float64]:
            corners = np.array([[x, y], [x + width, y], [x + width, y - width], [x, y - width]])
            world: NDArray[np.float64] = corners @ turn.T + np.array(centre)
            return world

        board = side_m + 2 * cell
        self.polygon(square(-board / 2, board / 2, board), (238, 238, 238))
        self.polygon(square(-side_m / 2, side_m / 2, side_m), (24, 24, 24))
        for row in range(_CELLS):
            for column in range(_CELLS):
                if bits[row, column]:
                    x, y = -side_m / 2 + column * cell, side_m / 2 - row * cell
                    self.polygon(square(x, y, cell), (238, 238, 238))


@functools.cache
def marker_bits(marker_id: int) -> NDArray[np.bool_]:
    """Return the cells (7, 7) of a DICT_5X5_50 marker; True is white."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    image = cv2.aruco.generateImageMarker(dictionary, marker_id, _CELLS, borderBits=1)
    bits: NDArray[np.bool_] = np.asarray(image) > 127
    return bits


@functools.lru_cache(maxsize=4)
def _base(map: Map) -> Image:
    """Paint the map without marker, weather and light; the same for all its scenarios."""
    x_min, x_max, y_min, y_max = map.bounds_m
    box = (x_min - _MARGIN_M, x_max + _MARGIN_M, y_min - _MARGIN_M, y_max + _MARGIN_M)
    rng = np.random.default_rng(map.ground.texture_seed)
    rows, columns = round((box[3] - box[2]) / _WIDE_M), round((box[1] - box[0]) / _WIDE_M)
    image = _texture(map, rows, columns, rng)
    canvas = _Canvas(image, box, _WIDE_M)
    for layer in map.ground.layers:
        _paint_layer(canvas, layer, rng)
    image.flags.writeable = False
    return image


_SCALES = {
    # Amplitudes of noise in grey levels at wavelengths of about 4 cm, 16 cm, 1 m and 5 m.
    "concrete": (5.0, 4.0, 5.0, 6.0),
    "asphalt": (9.0, 4.0, 3.0, 4.0),
    "grass": (13.0, 10.0, 7.0, 7.0),
    "sand": (5.0, 4.0, 4.0, 5.0),
    "soil": (8.0, 7.0, 6.0, 5.0),
}


def _texture(map: Map, rows: int, columns: int, rng: np.random.Generator) -> Image:
    noise = np.zeros((rows, columns), np.float32)
    for amplitude, step in zip(_SCALES[map.ground.texture], (1, 4, 25, 125), strict=True):
        small = rng.standard_normal((rows // step + 2, columns // step + 2)).astype(np.float32)
        noise += amplitude * cv2.resize(small, (columns, rows), interpolation=cv2.INTER_CUBIC)
    tint = np.array([1.0, 1.0, 0.9 if map.ground.texture == "grass" else 1.0], np.float32)
    image = np.array(map.ground.colour, np.float32) + noise[..., None] * tint
    if map.ground.texture == "concrete":
        joint = round(4.0 / _WIDE_M)
        image[::joint] -= 22
        image[:, ::joint] -= 22
    clipped: Image = np.clip(image, 0, 255).astype(np.uint8)
    return clipped


def _paint_layer(canvas: _Canvas, layer: Layer, rng: np.random.Generator) -> None:
    points = np.array(layer.points_m, dtype=np.float64)
    colour = tuple(float(value) for value in layer.colour)
    if layer.kind == "rectangle":
        (x0, y0), (x1, y1) = points[0], points[1]
        canvas.polygon(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), colour)
    elif layer.kind == "polygon":
        canvas.polygon(points, colour)
    elif layer.kind == "line":
        canvas.stroke(points, layer.size_m, colour)
    elif layer.kind in ("circle", "arc"):
        start, end = layer.angles_rad if layer.kind == "arc" else (0.0, 2 * math.pi)
        angles = np.linspace(start, end, 64)
        ring = points[0] + layer.size_m * np.column_stack([np.cos(angles), np.sin(angles)])
        if layer.width_m > 0:
            canvas.stroke(ring, layer.width_m, colour)
        else:
            canvas.polygon(ring, colour)
    elif layer.kind == "marker":
        place = (float(points[0, 0]), float(points[0, 1]))
        canvas.marker(place, layer.size_m, layer.yaw_rad, layer.marker_id)
    elif layer.kind == "roots":
        _roots(canvas, points[0], layer.size_m, colour, rng)
    else:
        _patches(canvas, points[0], layer.size_m, colour, rng)


def _roots(
    canvas: _Canvas,
    centre: NDArray[np.float64],
    spread_m: float,
    colour: Sequence[float],
    rng: np.random.Generator,
) -> None:
    for _ in range(7):
        heading, at, width = rng.uniform(0, 2 * math.pi), centre.copy(), 0.14
        path = [at.copy()]
        for _ in range(12):
            heading += rng.normal(0, 0.35)
            at = at + spread_m / 12 * np.array([math.cos(heading), math.sin(heading)])
            path.append(at)
        for start, end in itertools.pairwise(path):
            canvas.stroke(np.array([start, end]), width, colour)
            width *= 0.88


def _patches(
    canvas: _Canvas,
    centre: NDArray[np.float64],
    spread_m: float,
    colour: Sequence[float],
    rng: np.random.Generator,
) -> None:
    """Draw mottled wear: many small translucent blobs, so that no patch has a hard edge."""
    layer = canvas.image.copy()
    over = _Canvas(layer, canvas.box, canvas.resolution)
    for _ in range(60):
        at = centre + rng.normal(0, spread_m / 3, 2)
        angles = np.linspace(0, 2 * math.pi, 13)[:-1]
        radius = rng.uniform(0.1, 0.5) * rng.uniform(0.7, 1.3, 12)
        over.polygon(
            at + radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), colour
        )
    cv2.addWeighted(canvas.image, 0.6, layer, 0.4, 0.0, canvas.image)


def _detail(
    painted: Image,
    wide_box: tuple[float, float, float, float],
    box: tuple[float, float, float, float],
    resolution: float,
    map: Map,
) -> Image:
    """Enlarge a piece of the map and add the grain that the coarse picture cannot hold."""
    size = round((box[1] - box[0]) / resolution)
    zoom = resolution / _WIDE_M
    x = (box[0] - wide_box[0]) / _WIDE_M + zoom / 2 - 0.5
    y = (wide_box[3] - box[3]) / _WIDE_M + zoom / 2 - 0.5
    piece = cv2.warpAffine(
        painted,
        np.array([[zoom, 0.0, x], [0.0, zoom, y]]),
        (size, size),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REFLECT_101,
    )
    grain = np.random.default_rng(map.ground.texture_seed + 1).standard_normal((size, size))
    amplitude = _SCALES[map.ground.texture][0]
    image: Image = np.clip(piece + amplitude * grain[..., None], 0, 255).astype(np.uint8)
    return image


def _wet(image: Image, wetness: float) -> None:
    if wetness > 0:
        cv2.convertScaleAbs(image, image, 1 - WET_ALBEDO_LOSS * wetness)


@functools.cache
def _cover_tiles() -> tuple[NDArray[np.float32], Image, NDArray[np.float32]]:
    """Ranks in [0, 1] and colours of fallen leaves, and ranks of snow, on a tile of 8 m.

    A place is covered when its rank is below the cover gene, so that a gene of 0.1 covers
    a tenth of the ground and a larger gene covers the same places and more.
    """
    size = round(_TILE_M / _INSET_M)
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
    radius = rng.uniform(0.04, 0.075) / _INSET_M * lobes
    turn = rng.uniform(0, 2 * math.pi)
    return np.column_stack([radius * np.cos(angles + turn), radius * np.sin(angles + turn)])


def _ranks(values: NDArray[np.float32]) -> NDArray[np.float32]:
    flat = values.ravel()
    ordered = np.sort(flat)
    share = np.searchsorted(ordered, flat, side="right") / flat.size
    return share.reshape(values.shape).astype(np.float32)


def _cover(
    image: Image,
    box: tuple[float, float, float, float],
    resolution: float,
    shift: NDArray[np.float64],
    conditions: Conditions,
) -> None:
    if conditions.leaf_cover <= 0 and conditions.snow_cover <= 0:
        return
    leaves, colours, snow = _cover_tiles()
    size = leaves.shape[0]
    rows, columns = image.shape[:2]
    x = ((box[0] - shift[0] + (np.arange(columns) + 0.5) * resolution) / _INSET_M).astype(
        int
    ) % size
    y = ((shift[1] - box[3] + (np.arange(rows) + 0.5) * resolution) / _INSET_M).astype(int) % size
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
    leaves, _, snow = _cover_tiles()
    size = leaves.shape[0]
    column = ((places_m[:, 0] - shift_m[0]) / _INSET_M).astype(int) % size
    row = ((shift_m[1] - places_m[:, 1]) / _INSET_M).astype(int) % size
    under = np.zeros(len(places_m), np.bool_)
    if conditions.leaf_cover > 0:
        under |= leaves[row, column] <= conditions.leaf_cover
    if conditions.snow_cover > 0:
        under |= snow[row, column] <= conditions.snow_cover
    return under


def _light(canvas: _Canvas, map: Map, conditions: Conditions) -> Image:
    """Return the piece, darker where the static bodies keep the sun from it."""
    if conditions.direct_share <= 0.01 or conditions.sun[2] <= 0.02:
        return canvas.image
    image = canvas.image.copy()
    mask = np.zeros(image.shape[:2], np.uint8)
    shade = _Canvas(mask, canvas.box, canvas.resolution)
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
