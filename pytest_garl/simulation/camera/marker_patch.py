"""The marker as it lies on the ground: the grey of each of its places, before air and sensor."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import Pad, PlacedMarker
from pytest_garl.simulation.camera.canvas import (
    BLACK_LEVEL,
    WHITE_LEVEL,
    Canvas,
    marker_bits,
)
from pytest_garl.simulation.camera.ground import shadowed
from pytest_garl.simulation.camera.ground_cover import cover
from pytest_garl.simulation.camera.wear import wear
from pytest_garl.simulation.camera.weather import WET_ALBEDO_LOSS, Conditions

Array = NDArray[np.float32]
PROBES_PER_MODULE = 3
_PX_PER_PROBE = 8
"""The patch of the default marker is painted at about the resolution of the ground, 0.01 m, before
it is averaged."""
GREY = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in a grey level (ITU-R BT.601), as detectors compute it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MarkerPatch:
    """Places on a marker with its margin, three by three per module, row by row from its top left.

    ``places_m`` (n, 2) are in the world; ``white`` (n,) says where the print is white; ``light``
    (n,) is the share of full light that static bodies let through; ``albedo`` (n,) the grey level
    in full light with what lies on the board; ``white_level`` and ``black_level`` those of bare
    modules.
    """

    marker: PlacedMarker
    places_m: NDArray[np.float64]
    white: NDArray[np.bool_]
    light: Array
    albedo: Array
    white_level: float
    black_level: float

    @property
    def probes(self) -> int:
        """Places along a side."""
        return math.isqrt(len(self.white))

    @property
    def modules(self) -> int:
        """Modules along a side: the marker's, and a white margin of one on each side."""
        return self.probes // PROBES_PER_MODULE

    @property
    def module_m(self) -> float:
        """Side of a module."""
        return self.marker.side_m / (self.modules - 2)


@functools.cache
def modules(marker_id: int, dictionary: str) -> NDArray[np.bool_]:
    """Return which modules (n, n) of a marker with its margin are white."""
    return np.pad(marker_bits(marker_id, dictionary), 1, constant_values=True)


def paint_patch(
    marker: PlacedMarker,
    pad: Pad,
    map: Map,
    conditions: Conditions,
    cover_shift_m: NDArray[np.float64],
) -> MarkerPatch:
    """Paint one marker of the pad as ``paint_ground`` does, without the ground about it.

    ``cover_shift_m`` has the shape (2,).
    """
    white = modules(marker.id, marker.dictionary)
    probes = len(white) * PROBES_PER_MODULE
    half, size = marker.side_m / (len(white) - 2) * len(white) / 2, probes * _PX_PER_PROBE
    step = 2 * half / size
    # A turned marker is painted with its surroundings, and cut out.
    cos, sin = math.cos(marker.yaw_rad), math.sin(marker.yaw_rad)
    wide = size if sin == 0 else math.ceil(size * (abs(cos) + abs(sin)))
    x, y = marker.place_m
    reach = half * wide / size
    bounds = (x - reach, x + reach, y - reach, y + reach)
    canvas = Canvas(np.zeros((wide, wide, 3), np.uint8), bounds, step)
    canvas.board(pad)
    wear(canvas, pad, map)
    canvas.tarpaulin(pad)
    dry = 1 - WET_ALBEDO_LOSS * conditions.wetness
    cv2.convertScaleAbs(canvas.image, canvas.image, dry)
    cover(canvas.image, bounds, step, cover_shift_m, conditions)
    full = Canvas(np.full((wide, wide), 255, np.uint8), bounds, step)
    light = _averaged(shadowed(full, map, conditions), probes, marker.yaw_rad) / np.float32(255)
    along = (np.arange(probes) + 0.5) / probes * 2 * half - half
    across, down = np.meshgrid(along, along)
    ones = np.ones((PROBES_PER_MODULE, PROBES_PER_MODULE), np.bool_)
    return MarkerPatch(
        marker=marker,
        places_m=np.column_stack(
            [
                (x + (cos * across + sin * down)).ravel(),
                (y - (cos * down - sin * across)).ravel(),
            ]
        ),
        white=np.kron(white, ones).ravel(),
        light=light.ravel(),
        albedo=(_averaged(canvas.image, probes, marker.yaw_rad) @ GREY).ravel(),
        white_level=dry * WHITE_LEVEL,
        black_level=dry * BLACK_LEVEL,
    )


def _averaged(image: NDArray[np.uint8], probes: int, yaw_rad: float) -> Array:
    """Return the mean grey or colour of each place of a marker in the image's middle."""
    size = probes * _PX_PER_PROBE
    if math.sin(yaw_rad) != 0:
        cos, sin, middle = math.cos(yaw_rad), math.sin(yaw_rad), (image.shape[0] - 1) / 2
        mine = (size - 1) / 2
        # From the marker's pixels to the image's, whose rows run south.
        turn = np.array([[cos, sin], [-sin, cos]])
        shift = middle - turn @ (mine, mine)
        image = np.asarray(
            cv2.warpAffine(
                image,
                np.column_stack([turn, shift]),
                (size, size),
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            np.uint8,
        )
    small = cv2.resize(image, (probes, probes), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)
