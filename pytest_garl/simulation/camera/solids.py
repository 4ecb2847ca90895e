"""Bodies and objects in a frame: their triangles, and their shadows on the ground."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from pytest_garl.scenarios.bodies import Part
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.simulation.camera.ground import shadow_of
from pytest_garl.simulation.camera.meshes import (
    Mesh,
    clip_near,
    mesh_of,
    placed_hulls,
    yaw_matrix,
)
from pytest_garl.simulation.camera.projection import FAR_M, NEAR_M, View
from pytest_garl.simulation.camera.weather import Conditions

Array = NDArray[np.float32]
BodyPose = tuple[tuple[float, float, float], float]
"""Position and yaw."""
_SHIFT = 4
"""Fractional bits of the coordinates that OpenCV draws at."""
_TO_GL = np.diag([1.0, -1.0, -1.0, 1.0]).astype(np.float32)
"""From camera axes (right, down, forward) to those of the rasteriser."""
_SLACK_M = 1e-3
"""A box this far out of the view is out of it, however corners are rounded."""
_COARSE_PX = 4.0
"""A part of this radius in pixels is off by half a pixel if drawn with 6 sides instead of 10."""
_COARSE_M = (0.0, 0.12, 0.3, 1.0)
"""One level of detail each: the largest radius of a part that the level draws with 6 sides."""


@dataclass(slots=True, kw_only=True, eq=False)
class _Solid:
    """One body as triangles; keeps its colours and shadows until its yaw changes."""

    segment: int
    meshes: tuple[Mesh, ...]
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = math.nan
    rotation: Array = field(default_factory=lambda: np.eye(3, dtype=np.float32))
    shaded_colours: dict[int, Array] = field(default_factory=dict)
    shadow_outlines: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    """Outlines of the parts' shadows relative to the body's position, concatenated."""
    corner_counts: list[int] = field(default_factory=list)
    """Number of corners of each outline."""
    shadow_reach_m: float = 0.0
    """How far the shadow reaches from below the body's position."""

    def move_to(self, pose: BodyPose) -> bool:
        """Move to a pose; return whether the solid has turned."""
        position_m, yaw = pose
        self.position_m = position_m
        if yaw == self.yaw_rad:
            return False
        self.yaw_rad, self.rotation = yaw, yaw_matrix(yaw)
        self.shaded_colours = {}
        return True

    def cast_shadow(self, sun: tuple[float, float, float]) -> None:
        hulls = placed_hulls(self.meshes[0], (0.0, 0.0, 0.0), self.yaw_rad)
        flat = (shadow_of(hull, sun) for hull in hulls)
        outlines = [cv2.convexHull(s).reshape(-1, 2) for s in flat]
        self.shadow_outlines = np.concatenate(outlines).astype(np.float64)
        self.corner_counts = [len(outline) for outline in outlines]
        self.shadow_reach_m = float(np.hypot(*self.shadow_outlines.T).max())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaintedSolid:
    """The pixels of one solid, float32 (h, w, 3) in a window of the image, where ``covered``."""

    rows: slice
    columns: slice
    covered: NDArray[np.bool_]
    drawn: Array

    def paint_onto(self, image: NDArray[np.uint8]) -> None:
        """Draw these pixels over the image, (h, w, 3)."""
        window = image[self.rows, self.columns]
        cv2.copyTo(cv2.convertScaleAbs(self.drawn), self.covered.view(np.uint8), window)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shadow:
    """A dynamic object's shadow: outlines (n, 2) relative to ``position_m``, concatenated.

    No corner of an outline is farther than ``reach_m`` from there.
    """

    position_m: tuple[float, float, float]
    outlines: NDArray[np.float64]
    corner_counts: tuple[int, ...]
    radius_m: float
    reach_m: float

    def place_m(self, sun: tuple[float, float, float]) -> tuple[float, float]:
        """Return the place on the ground to which the outlines are relative."""
        x, y, z = self.position_m
        return x - sun[0] / sun[2] * z, y - sun[1] / sun[2] * z


class Solids:
    """Draws static bodies and dynamic objects into frames."""

    def __init__(self, map: Map, conditions: Conditions, segment_ids: Mapping[str, int]) -> None:
        self._conditions = conditions
        self._static = [
            _Solid(segment=segment_ids[body.name], meshes=_levels(body.parts))
            for body in map.bodies
        ]
        for solid, body in zip(self._static, map.bodies, strict=True):
            # Its shadow is painted on the ground once per flight.
            solid.move_to((body.position_m, body.yaw_rad))
        boxes = [
            _box(body.parts) @ solid.rotation.T.astype(np.float64) + solid.position_m
            for solid, body in zip(self._static, map.bodies, strict=True)
        ]
        self._boxes_m = np.array(boxes).reshape(-1, 8, 3)
        self._moving = [
            _Solid(segment=segment_ids[name], meshes=_levels(OBJECT_TYPES[kind].parts))
            for name, kind in map.present_objects
        ]
        self._segments = len(segment_ids)
        self._settings = cv2.TriangleRasterizeSettings()
        self._settings.setShadingType(cv2.RASTERIZE_SHADING_FLAT)
        self._settings.setCullingMode(cv2.RASTERIZE_CULLING_NONE)

    def place(self, objects: Sequence[BodyPose]) -> None:
        """Move the dynamic objects, in the map's order, to their present poses."""
        for solid, pose in zip(self._moving, objects, strict=True):
            if solid.move_to(pose) and sun_shines(self._conditions):
                solid.cast_shadow(self._conditions.sun)

    def shadows(self) -> tuple[Shadow, ...]:
        """Return the present shadows of the dynamic objects."""
        return tuple(
            Shadow(
                position_m=solid.position_m,
                outlines=solid.shadow_outlines,
                corner_counts=tuple(solid.corner_counts),
                radius_m=solid.meshes[0].radius_m,
                reach_m=solid.shadow_reach_m,
            )
            for solid in self._moving
        )

    def draw(
        self, depth: Array, segmentation: NDArray[np.int32], view: View
    ) -> tuple[NDArray[np.intp], list[PaintedSolid]]:
        """Draw all solids into depth and segmentation, (h, w) each.

        Returns the number of pixels of each segment, (s,), and the painted solids in drawing order.
        """
        axes = view.axes.astype(np.float32)
        pixels = np.zeros(self._segments, np.intp)
        layers = []
        near = (self._static[index] for index in self._in_view(view))
        for solid in (*near, *self._moving):
            at = np.array(solid.position_m)
            x, y, z = (float(value) for value in view.axes @ (at - view.eye))
            radius = solid.meshes[0].radius_m
            if not view.shows(x, y, z, radius):
                continue
            level = _level_at(max(NEAR_M, z - radius) / view.camera.focal_px * _COARSE_PX)
            mesh = solid.meshes[level]
            # In the solid's own frame, so that only triangles that face the camera are rotated.
            eye = solid.rotation.T @ (view.eye - at).astype(np.float32)
            facing = np.flatnonzero(mesh.normals @ eye > mesh.offsets)
            corners = mesh.corners[facing].reshape(-1, 3)
            seen = corners @ (axes @ solid.rotation).T + np.array([x, y, z], np.float32)
            if z - radius <= NEAR_M:
                triangles, origin = clip_near(seen.reshape(-1, 3, 3), NEAR_M)
                seen, facing = triangles.reshape(-1, 3), facing[origin]
            if len(seen):
                paint = self._shade(solid, level)[facing]
                layer = self._rasterise(seen, paint, depth, view)
                if layer is not None:
                    segmentation[layer.rows, layer.columns][layer.covered] = solid.segment
                    pixels[solid.segment] = np.count_nonzero(layer.covered)
                    layers.append(layer)
        return pixels, layers

    def _in_view(self, view: View) -> NDArray[np.intp]:
        """Return the numbers of the static bodies whose boxes reach into the view's pyramid."""
        seen = self._boxes_m @ view.axes.T - view.axes @ view.eye
        ahead = seen[..., 2]
        edge = np.array(view.reach) * ahead[..., None] + _SLACK_M
        # Out of the view is a box of which all corners are on the outer side of one plane.
        aside, before = seen[..., :2] > edge, seen[..., :2] < -edge
        behind = np.all(ahead < NEAR_M - _SLACK_M, axis=1)
        hidden = np.any(np.all(aside, axis=1) | np.all(before, axis=1), axis=1) | behind
        return np.flatnonzero(~hidden)

    def _rasterise(
        self, corners: Array, paint: Array, depth: Array, view: View
    ) -> PaintedSolid | None:
        """Draw camera-frame triangles (corners (3 n, 3), paint (n, 3)) where they are nearest.

        OpenCV's rasteriser costs by the area of its target, so it gets only the window
        that holds the triangles; a shear along the depth moves the optical axis there.
        """
        rows, columns = view.box(view.pixels(corners))
        height, width = rows.stop - rows.start, columns.stop - columns.start
        if height <= 0 or width <= 0:
            return None
        (cx, cy), focal = view.camera.centre_px, view.camera.focal_px
        across = (columns.start + (width - 1) / 2 - cx) / focal
        down = (rows.start + (height - 1) / 2 - cy) / focal
        sheared = corners - corners[:, 2:] * np.array([across, down, 0.0], np.float32)
        drawn = np.zeros((height, width, 3), np.float32)
        cv2.triangleRasterize(
            sheared,
            _triangle_indices(len(paint)),
            np.repeat(paint, 3, axis=0),
            drawn,
            depth[rows, columns],
            _TO_GL,
            2 * math.atan(height / 2 / focal),
            NEAR_M,
            FAR_M,
            self._settings,
        )
        covered = cv2.extractChannel(drawn, 0) > 0
        return PaintedSolid(rows=rows, columns=columns, covered=covered, drawn=drawn)

    def _shade(self, solid: _Solid, level: int) -> Array:
        """Return the mesh's colours in this light, kept until the solid turns.

        No colour is black, because a black pixel counts as not drawn.
        """
        kept = solid.shaded_colours.get(level)
        if kept is None:
            mesh, conditions = solid.meshes[level], self._conditions
            normals = mesh.normals @ solid.rotation.T
            share = conditions.direct_share
            facing = np.clip(normals @ np.array(conditions.sun, np.float32), 0, 1)
            sky = 0.75 + 0.25 * normals[:, 2]
            light = (1 - share) * sky + share * facing / max(0.35, conditions.sun[2])
            lit = mesh.colours * np.clip(light, 0, 1.15)[:, None]
            kept = solid.shaded_colours[level] = np.clip(np.round(lit), 1, 255).astype(np.float32)
        return kept


def draw_shadows(
    image: NDArray[np.uint8], view: View, shadows: Sequence[Shadow], conditions: Conditions
) -> None:
    """Darken the ground of an image, (h, w, 3), in the shadows of the dynamic objects."""
    if not sun_shines(conditions):
        return
    sun = conditions.sun
    reach = 3 * max(2.0, float(view.eye[2]))
    outlines: list[NDArray[np.float64]] = []
    lengths: list[int] = []
    for shadow in shadows:
        x, y = shadow.place_m(sun)
        if math.hypot(x - view.eye[0], y - view.eye[1]) < reach + shadow.radius_m:
            outlines.append(shadow.outlines + np.array([x, y]))
            lengths += shadow.corner_counts
    if not outlines:
        return
    points, lengths = view.ground_polygons(np.concatenate(outlines), lengths)
    rows, columns = view.box(points)
    part = image[rows, columns]
    if part.size == 0:
        return
    mask = np.zeros(part.shape[:2], np.uint8)
    fixed = np.round((points - (columns.start, rows.start)) * 2**_SHIFT).astype(np.int32)
    start = 0
    for length in lengths:
        cv2.fillConvexPoly(mask, fixed[start : start + length], (255.0,), cv2.LINE_8, _SHIFT)
        start += length
    share = conditions.direct_share
    cv2.copyTo(cv2.convertScaleAbs(part, alpha=1 - share), mask, part)


def sun_shines(conditions: Conditions) -> bool:
    """Whether things cast shadows."""
    return conditions.direct_share > 0.01 and conditions.sun[2] > 0.02


@functools.lru_cache(maxsize=64)
def _box(parts: tuple[Part, ...]) -> NDArray[np.float64]:
    """Return the corners (8, 3), in the body's frame, of a box about it."""
    corners = np.concatenate([mesh.corners.reshape(-1, 3) for mesh in _levels(parts)])
    sides = np.stack([corners.min(axis=0), corners.max(axis=0)]).astype(np.float64)
    picks = np.array(list(itertools.product((0, 1), repeat=3)))
    box: NDArray[np.float64] = sides[picks, np.arange(3)]
    box.setflags(write=False)
    return box


def _levels(parts: tuple[Part, ...]) -> tuple[Mesh, ...]:
    return tuple(mesh_of(parts, coarse_below_m=radius) for radius in _COARSE_M)


def _level_at(radius_m: float) -> int:
    """Return the coarsest level of detail for which parts up to ``radius_m`` may be coarse."""
    return max(level for level, limit in enumerate(_COARSE_M) if limit <= radius_m)


@functools.lru_cache(maxsize=4)
def _corner_indices(most: int) -> NDArray[np.int32]:
    return np.arange(3 * most, dtype=np.int32).reshape(-1, 3)


def _triangle_indices(count: int) -> NDArray[np.int32]:
    """Return the indices (count, 3) of the corners of ``count`` triangles, in order."""
    return _corner_indices(max(4096, 1 << count.bit_length()))[:count]
