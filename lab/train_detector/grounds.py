"""Invented places to train in: no ground of a flight is ever seen in training."""

from __future__ import annotations

import math

import numpy as np

from pytest_garl.fiducial import MARKER_SIDE_M
from pytest_garl.scenarios.bodies import Body
from pytest_garl.scenarios.maps.map import Ground, Layer, LayerKind, Map, Texture
from pytest_garl.scenarios.static_bodies import STATIC_BODIES

HALF_M = 8.0
"""Half the side of a place: the disc of 7.5 m in which the marker lies, and a little more."""
FIRST_TEXTURE_SEED = 1_000_000
"""The maps that are flown have texture seeds below this."""
HIGHEST_ID = 49
"""DICT_5X5_50 has the ids 0 to 49."""
_COLOURS = {
    "concrete": (150, 148, 142),
    "asphalt": (84, 86, 90),
    "grass": (98, 120, 62),
    "sand": (186, 168, 130),
    "soil": (116, 96, 76),
}
_WITHOUT_COURT: tuple[Texture, ...] = ("grass", "sand", "soil", "asphalt")
_ALL: tuple[Texture, ...] = ("concrete", *_WITHOUT_COURT)
Colour = tuple[int, int, int]


def invented_map(rng: np.random.Generator, index: int, *, court: bool) -> Map:
    """Return a random place; ``court=False`` leaves out concrete, painted lines and areas."""
    textures = _ALL if court else _WITHOUT_COURT
    texture = textures[rng.integers(len(textures))]
    layers: list[Layer] = []
    if court and rng.random() < 0.7:
        layers += _court_lines(rng)
    layers += _wear(rng)
    layers += _fakes(rng)
    layers += _decoys(rng, 2 + int(rng.integers(3)))
    return Map(
        name=f"invented-{index}",
        title="invented",
        bounds_m=(-HALF_M, HALF_M, -HALF_M, HALF_M),
        gps_position_m=(0.0, 0.0),
        uav_start_m=(0.0, -HALF_M, 0.0),
        ground=Ground(
            texture=texture,
            texture_seed=int(rng.integers(FIRST_TEXTURE_SEED, 2**31)),
            colour=_near(rng, _COLOURS[texture], 28),
            layers=tuple(layers),
        ),
        bodies=_bodies(rng, court),
        objects=(("person", 2), ("dog", 1), ("bird", 1)),
        sha256="",
    )


def _court_lines(rng: np.random.Generator) -> list[Layer]:
    """Lines, circles and areas of some sport, nowhere as on the court that is flown."""
    layers = []
    for _ in range(rng.integers(0, 3)):
        x, y = _place(rng)
        width, depth = (float(value) for value in rng.uniform(1.5, 7.0, 2))
        colour = _near(rng, _AREAS[rng.integers(len(_AREAS))], 20)
        layers.append(
            Layer(kind="rectangle", points_m=((x, y), (x + width, y + depth)), colour=colour)
        )
    paint = _near(rng, _PAINTS[rng.integers(len(_PAINTS))], 14)
    stroke = float(rng.uniform(0.04, 0.12))
    for _ in range(rng.integers(2, 7)):
        angle = float(rng.choice([0.0, math.pi / 2, rng.uniform(0, math.pi)], p=[0.4, 0.4, 0.2]))
        (x, y), half = _place(rng), float(rng.uniform(2, 12))
        dx, dy = half * math.cos(angle), half * math.sin(angle)
        ends = (x - dx, y - dy), (x + dx, y + dy)
        layers.append(Layer(kind="line", points_m=ends, size_m=stroke, colour=paint))
    for _ in range(rng.integers(0, 4)):
        start, radius = float(rng.uniform(0, 6)), float(rng.uniform(0.6, 7))
        angles = (start, start + float(rng.uniform(1.5, 6.3)))
        layers.append(
            Layer(
                kind="arc",
                points_m=(_place(rng),),
                size_m=radius,
                width_m=stroke,
                angles_rad=angles,
                colour=paint,
            )
        )
    return layers


_AREAS: tuple[Colour, ...] = ((150, 66, 56), (60, 92, 140), (70, 120, 74), (160, 120, 60))
_PAINTS: tuple[Colour, ...] = ((230, 230, 224), (226, 196, 60), (60, 60, 62))


def _wear(rng: np.random.Generator) -> list[Layer]:
    layers = []
    for _ in range(rng.integers(0, 4)):
        kind: LayerKind = "patches" if rng.random() < 0.7 else "roots"
        colour = _near(rng, (112, 108, 90), 40)
        spread = float(rng.uniform(2, 7))
        layers.append(Layer(kind=kind, points_m=(_place(rng),), size_m=spread, colour=colour))
    return layers


def _fakes(rng: np.random.Generator) -> list[Layer]:
    """Black and white things that are no markers: boards without a code, chessboards, bars."""
    layers = []
    for _ in range(rng.integers(1, 4)):
        x, y = _place(rng)
        side = float(rng.uniform(0.6, 2.2))
        white, black = _near(rng, (236, 236, 236), 12), _near(rng, (26, 26, 26), 14)
        layers.append(
            Layer(kind="rectangle", points_m=((x, y), (x + side, y + side)), colour=white)
        )
        cells, margin = int(rng.integers(1, 9)), 0.12 * side
        cell = (side - 2 * margin) / cells
        style = rng.integers(4)
        for row in range(cells):
            for column in range(cells):
                dark = (
                    (row + column) % 2 == 0,
                    column % 2 == 0,
                    min(row, column) == 0 or max(row, column) == cells - 1,
                    rng.random() < 0.5,
                )[style]
                if dark:
                    low = (x + margin + column * cell, y + margin + row * cell)
                    high = (low[0] + cell, low[1] + cell)
                    layers.append(Layer(kind="rectangle", points_m=(low, high), colour=black))
    return layers


def _decoys(rng: np.random.Generator, count: int) -> list[Layer]:
    """Other markers on the ground: mostly of the classes, sometimes of no class."""
    layers: list[Layer] = []
    for _ in range(count):
        at = _place(rng)
        if any(math.dist(at, other.points_m[0]) < 3.5 for other in layers):
            continue
        known = rng.random() < 0.65
        number = int(rng.integers(1, 4)) if known else int(rng.integers(4, HIGHEST_ID + 1))
        yaw = float(rng.uniform(0, 2 * math.pi))
        layers.append(
            Layer(
                kind="marker", points_m=(at,), size_m=MARKER_SIDE_M, yaw_rad=yaw, marker_id=number
            )
        )
    return layers


def _bodies(rng: np.random.Generator, court: bool) -> tuple[Body, ...]:
    kinds = ("tree", "tree", "bench", "hoop") if court else ("tree",)
    bodies = []
    for index in range(rng.integers(1, 5)):
        kind = kinds[rng.integers(len(kinds))]
        x, y = _place(rng)
        sizes = {}
        if kind == "tree":
            sizes = {
                "height_m": float(rng.uniform(4, 7.5)),
                "crown_m": float(rng.uniform(2.4, 5)),
            }
        bodies.append(
            Body(
                name=f"{kind}-{index}",
                kind=kind,
                parts=STATIC_BODIES[kind](**sizes),
                position_m=(x, y, 0.0),
                yaw_rad=float(rng.uniform(0, 2 * math.pi)),
            )
        )
    return tuple(bodies)


def _place(rng: np.random.Generator) -> tuple[float, float]:
    x, y = rng.uniform(-HALF_M, HALF_M, 2)
    return float(x), float(y)


def _near(rng: np.random.Generator, colour: Colour, spread: float) -> Colour:
    red, green, blue = np.clip(np.array(colour) + rng.uniform(-spread, spread, 3), 0, 255)
    return int(red), int(green), int(blue)
