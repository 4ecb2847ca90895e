"""How a camera frame shows the marker, computed from geometry and conditions without a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.flight.flight import MarkerView
from pytest_garl.landing_system import Camera
from pytest_garl.simulation.camera.exposure import Exposure
from pytest_garl.simulation.camera.gloss import Gloss
from pytest_garl.simulation.camera.image_sensor import Sensor
from pytest_garl.simulation.camera.lens import Lens
from pytest_garl.simulation.camera.marker_patch import (
    GREY,
    PROBES_PER_MODULE,
    MarkerPatch,
)
from pytest_garl.simulation.camera.particles import Particles
from pytest_garl.simulation.camera.projection import NEAR_M, View
from pytest_garl.simulation.camera.solids import PaintedSolid, Shadow, sun_shines
from pytest_garl.simulation.camera.weather import Conditions

Array = NDArray[np.float32]
_SHIFT = 4
_LEAST_SEEN = 4
"""This many places of white and of black must be seen for a contrast."""
_EDGE = 0.1
"""The painted edges of modules are a pixel wide and change this share of the places beside them."""
_MOSTLY = 0.25
"""A marker of which less is hidden can be read, if with errors."""
_ROUND = 4
"""Decimals that are recorded."""


class MarkerSight:
    """Tells how frames under one environment show the marker; see ``MarkerView``."""

    def __init__(
        self,
        camera: Camera,
        lens: Lens | None,
        patch: MarkerPatch,
        conditions: Conditions,
        sensor: Sensor,
        particles: Particles,
    ) -> None:
        self._camera, self._lens = camera, lens
        self._patch, self._conditions = patch, conditions
        self._sensor, self._particles = sensor, particles
        self._white, last = patch.white, patch.probes - 1
        row, column = np.divmod(np.arange(patch.probes**2), patch.probes)
        ring = np.minimum(np.minimum(row, last - row), np.minimum(column, last - column))
        ring //= PROBES_PER_MODULE
        self._margin, self._border, self._bits = ring == 0, ring == 1, ring >= 2
        self._on_marker = ~self._margin
        self._places_on_marker = int(np.count_nonzero(self._on_marker))
        self._middle_m = np.array(patch.marker.place_m)
        # The four corners of the marker, then the places: projected together.
        self._points_m = np.concatenate([np.array(patch.marker.outline_m), patch.places_m])
        self._airlight = float(np.array(conditions.airlight) @ GREY)
        self._errors = self._error(patch.albedo * patch.light, patch.light)

    def view(
        self,
        view: View,
        segmentation: NDArray[np.int32],
        layers: Sequence[PaintedSolid],
        shadows: Sequence[Shadow],
        gloss: Gloss | None,
        exposure: Exposure,
    ) -> MarkerView | None:
        """Return how a frame shows the marker, or None where none of it is in the frame.

        ``segmentation`` has the shape (h, w).
        """
        seen = self._points_m @ view.axes[:, :2].T - view.axes @ view.eye
        if seen[:4, 2].min() <= NEAR_M:
            return None
        drawn = view.pixels(seen)
        pixels, depth = drawn[4:], seen[4:, 2]
        drawn_column, drawn_row = np.rint(pixels).astype(np.intp).T
        column, row, corners = drawn_column, drawn_row, drawn[:4]
        height, width = segmentation.shape
        if self._lens:
            # Where the lens shows what was drawn.
            shown = self._lens.shown(drawn)
            corners, (column, row) = shown[:4], np.rint(shown[4:]).astype(np.intp).T
            height, width = self._lens.stretch.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        framed = np.count_nonzero(inside & self._on_marker) / self._places_on_marker
        if not framed:
            return None
        light = self._light(shadows)
        grey = self._patch.albedo * light
        errors = self._errors if light is self._patch.light else self._error(grey, light)
        hidden = np.zeros(len(grey), np.bool_)
        hidden[inside] = segmentation[drawn_row[inside], drawn_column[inside]] > 1
        if hidden.any():
            grey = _behind(grey, np.flatnonzero(hidden), drawn_row, drawn_column, layers)
            errors = self._error(grey, light)
        contrast = self._contrast(grey, pixels, view, depth, inside & (errors < 0.5), gloss)
        lit = light[inside]
        if (clear := exposure.clear(row[inside], column[inside])) is not None:
            # To a detector a dirty lens is what uneven light is.
            contrast, lit = contrast * float(clear.mean()), lit * clear
        module_px = self._px_per_module(corners)
        return MarkerView(
            share_in_frame=round(float(framed), _ROUND),
            edge_modules=round(_edge_modules(corners, width, height, module_px), _ROUND),
            px_per_module=round(module_px, _ROUND),
            border_hidden=_mean(errors, inside & self._border),
            bits_hidden=_mean(errors, inside & self._bits),
            margin_hidden=_mean(errors, inside & self._margin),
            contrast=round(contrast, _ROUND),
            uneven_light=round(float(lit.std()), _ROUND),
            clutter=round(self._particles.expected_cover(float(depth.mean())), _ROUND),
            noise=round(self._sensor.noise_levels, _ROUND),
            blur_px=round(exposure.blur_px(drawn[:4].mean(axis=0)), _ROUND),
        )

    def _error(self, grey: Array, light: Array) -> Array:
        """Return how far each place is turned into the other colour, from 0 to 1."""
        black, white = self._patch.black_level * light, self._patch.white_level * light
        whiteness = np.clip((grey - black) / (white - black), 0, 1)
        error = np.where(self._white, 1 - whiteness, whiteness)
        return np.clip((error - _EDGE) / (1 - 2 * _EDGE), 0, 1)

    def _light(self, shadows: Sequence[Shadow]) -> Array:
        """Return the share of full light at each place, with the shadows of the objects."""
        light, conditions = self._patch.light, self._conditions
        if not shadows or not sun_shines(conditions):
            return light
        patch, probes = self._patch, self._patch.probes
        half = patch.module_m * patch.modules / 2
        cos, sin = math.cos(patch.marker.yaw_rad), math.sin(patch.marker.yaw_rad)
        # From the world to the marker's pixels, whose rows run down.
        turn = np.array([[cos, sin], [sin, -cos]])
        mask: NDArray[np.uint8] | None = None
        for shadow in shadows:
            place = np.array(shadow.place_m(conditions.sun)) - self._middle_m
            if math.hypot(*place) > shadow.reach_m + math.sqrt(2) * half:
                continue
            if mask is None:
                mask = np.zeros((probes, probes), np.uint8)
            corners = (shadow.outlines + place) @ turn.T * (probes / 2 / half)
            fixed = np.round((corners + (probes / 2 - 0.5)) * 2**_SHIFT).astype(np.int32)
            start = 0
            for count in shadow.corner_counts:
                cv2.fillConvexPoly(mask, fixed[start : start + count], (1.0,), cv2.LINE_8, _SHIFT)
                start += count
        if mask is None or not mask.any():
            return light
        return np.where(mask.ravel() > 0, light * np.float32(1 - conditions.direct_share), light)

    def _contrast(
        self,
        grey: Array,
        pixels: Array,
        view: View,
        depth: NDArray[np.float64],
        seen: NDArray[np.bool_],
        gloss: Gloss | None,
    ) -> float:
        """Return the difference between white and black of the places that show their colour."""
        white, black = seen & self._white, seen & ~self._white
        if min(np.count_nonzero(white), np.count_nonzero(black)) < _LEAST_SEEN:
            return 0.0
        if gloss:
            away = ((pixels - gloss.centre_px) ** 2).sum(axis=1)
            grey = np.minimum(grey + gloss.strength * np.exp(-away / 2 / gloss.sigma_px**2), 255)
        if self._conditions.extinction_per_m > 0:
            (cx, cy), focal = self._camera.centre_px, self._camera.focal_px
            stretch = np.sqrt(1 + ((pixels - (cx, cy)) ** 2).sum(axis=1) / focal**2)
            through = np.exp(-self._conditions.extinction_per_m * depth * stretch)
            grey = grey * through + self._airlight * (1 - through)
        difference = float(grey[white].mean() - grey[black].mean())
        return round(max(0.0, difference * self._sensor.exposure), _ROUND)

    def _px_per_module(self, corners: Array) -> float:
        """Return the smaller singular value of the map from the ground to pixels, for a module."""
        patch = self._patch
        nw, ne, se, sw = corners.astype(np.float64) / patch.marker.side_m * patch.module_m
        (a, c), (b, d) = ((ne + se) - (nw + sw)) / 2, ((nw + ne) - (sw + se)) / 2
        total, determinant = a * a + b * b + c * c + d * d, a * d - b * c
        root = math.sqrt(max(0.0, total * total - 4 * determinant * determinant))
        return math.sqrt(max(0.0, (total - root) / 2))


class BoardSight:
    """Tells how frames show a board: by the marker that a camera reads best from there.

    That is the marker with the largest modules among those that are wholly in the frame and mostly
    not hidden, and the main marker if there is none.
    """

    def __init__(self, sights: Sequence[MarkerSight]) -> None:
        self._main, *self._nested = sights

    def view(
        self,
        view: View,
        segmentation: NDArray[np.int32],
        layers: Sequence[PaintedSolid],
        shadows: Sequence[Shadow],
        gloss: Gloss | None,
        exposure: Exposure,
    ) -> MarkerView | None:
        """Return how a frame shows the board, or None where nothing of it is in the frame.

        ``segmentation`` has the shape (h, w).
        """
        main = self._main.view(view, segmentation, layers, shadows, gloss, exposure)
        if not self._nested or (main and _is_whole(main)):
            return main
        others = (
            each.view(view, segmentation, layers, shadows, gloss, exposure) for each in self._nested
        )
        whole = [each for each in others if each and _is_whole(each)]
        return max(whole, key=lambda each: each.px_per_module) if whole else main


def _edge_modules(corners: Array, width: int, height: int, module_px: float) -> float:
    """Return the distance of the nearest corner from the picture's edge, at most a module."""
    low = float(corners.min()) + 0.5
    right = width - 0.5 - float(corners[:, 0].max())
    bottom = height - 0.5 - float(corners[:, 1].max())
    return min(1.0, min(low, right, bottom) / max(module_px, 1e-3))


def _is_whole(view: MarkerView) -> bool:
    return view.edge_modules >= 0 and max(view.border_hidden, view.bits_hidden) < _MOSTLY


def _behind(
    grey: Array,
    hidden: NDArray[np.intp],
    row: NDArray[np.intp],
    column: NDArray[np.intp],
    layers: Sequence[PaintedSolid],
) -> Array:
    """Return the grey of places with that of what hides them; later layers are nearer."""
    grey = grey.copy()
    for layer in layers:
        rows, columns = row[hidden] - layer.rows.start, column[hidden] - layer.columns.start
        height, width = layer.covered.shape
        within = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        rows, columns, places = rows[within], columns[within], hidden[within]
        drawn = layer.covered[rows, columns]
        grey[places[drawn]] = layer.drawn[rows[drawn], columns[drawn]] @ GREY
    return grey


def _mean(errors: Array, chosen: NDArray[np.bool_]) -> float:
    found = errors[chosen]
    return round(float(np.add.reduce(found) / len(found)), _ROUND) if len(found) else 1.0
