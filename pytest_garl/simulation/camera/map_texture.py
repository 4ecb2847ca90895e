"""The picture of a map's ground, without marker, weather and light: texture and what is painted."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps.map import Layer, Map
from pytest_garl.simulation.camera.canvas import Bounds, Canvas, Image

RESOLUTION_M = 0.04
_MARGIN_M = 15.0


def bounds_of(map: Map) -> Bounds:
    """Return the piece of ground that a map's picture shows: its bounds and a margin."""
    x_min, x_max, y_min, y_max = map.bounds_m
    return x_min - _MARGIN_M, x_max + _MARGIN_M, y_min - _MARGIN_M, y_max + _MARGIN_M


def picture(map: Map) -> Image:
    """Paint a map at RESOLUTION_M, read-only; the same for all its scenarios."""
    # Which objects a scenario removes, and who is a child, changes nothing on the ground.
    return _picture(dataclasses.replace(map, removed_objects=(), children=()))


@functools.lru_cache(maxsize=4)
def _picture(map: Map) -> Image:
    bounds_m = bounds_of(map)
    rng = np.random.default_rng(map.ground.texture_seed)
    rows, columns = (
        round((bounds_m[3] - bounds_m[2]) / RESOLUTION_M),
        round((bounds_m[1] - bounds_m[0]) / RESOLUTION_M),
    )
    image = _texture(map, rows, columns, rng)
    canvas = Canvas(image, bounds_m, RESOLUTION_M)
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
        joint = round(4.0 / RESOLUTION_M)
        image[::joint] -= 22
        image[:, ::joint] -= 22
    clipped: Image = np.clip(image, 0, 255).astype(np.uint8)
    return clipped


def _paint_layer(canvas: Canvas, layer: Layer, rng: np.random.Generator) -> None:
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
    canvas: Canvas,
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
    canvas: Canvas,
    centre: NDArray[np.float64],
    spread_m: float,
    colour: Sequence[float],
    rng: np.random.Generator,
) -> None:
    """Draw mottled wear: many small translucent blobs, so that no patch has a hard edge."""
    layer = canvas.image.copy()
    over = Canvas(layer, canvas.bounds_m, canvas.m_per_px)
    for _ in range(60):
        at = centre + rng.normal(0, spread_m / 3, 2)
        angles = np.linspace(0, 2 * math.pi, 13)[:-1]
        radius = rng.uniform(0.1, 0.5) * rng.uniform(0.7, 1.3, 12)
        over.polygon(
            at + radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), colour
        )
    cv2.addWeighted(canvas.image, 0.6, layer, 0.4, 0.0, canvas.image)


def detail(map: Map, bounds_m: Bounds, resolution: float) -> Image:
    """Enlarge a piece of a map to ``resolution`` (metres a pixel) and add the grain it lacks."""
    painted, wide_box = picture(map), bounds_of(map)
    size = round((bounds_m[1] - bounds_m[0]) / resolution)
    zoom = resolution / RESOLUTION_M
    x = (bounds_m[0] - wide_box[0]) / RESOLUTION_M + zoom / 2 - 0.5
    y = (wide_box[3] - bounds_m[3]) / RESOLUTION_M + zoom / 2 - 0.5
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
